walker_sim_sources(server_sources
  camera/camera camera/render_thread drive/pacer environments/batch_calls environments/environments
  environments/restores gazebo/physics_properties loop markers/marker_topics markers/scene_markers
  markers/state_markers outputs parameter_reader server simulation time/clock_follower
  time/reserved_until time/simulation_clock time/step_timing time/time_reservation
  topics/converters topics/diagnostics topics/effort_command topics/episode_statistics
  transport/service_port transport/service_session)
