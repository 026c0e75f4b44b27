walker_sim_sources(core_sources
  episode episode_record pool saved_state state_header thread_pool)
