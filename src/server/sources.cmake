walker_sim_sources(server_sources
  batch_calls camera/camera camera/render_thread drive/drive environments gazebo/physics_properties markers/marker_topics markers/scene_markers
  markers/state_markers outputs parameter_reader restores server simulation time/clock_follower
  time/reserved_until time/simulation_clock time/step_timing time/time_reservation topics/converters
  topics/diagnostics topics/effort_command topics/episode_statistics transport/service_port
  transport/service_session)
