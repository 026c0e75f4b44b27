walker_sim_sources(wire_sources master socket xml_rpc)
