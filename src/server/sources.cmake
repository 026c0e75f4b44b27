walker_sim_sources(server_sources
  camera/camera drive/drive environments gazebo/physics_properties markers/marker_topics
  markers/scene_markers markers/state_markers outputs parameter_reader server simulation
  time/simulation_clock time/time_reservation topics/converters topics/diagnostics
  transport/service_port transport/service_session)
