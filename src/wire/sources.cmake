walker_sim_sources(wire_sources master socket tcpros xml_rpc)
