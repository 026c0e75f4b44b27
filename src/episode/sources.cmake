walker_sim_sources(core_sources
  episode episode_record episode_state failure make parking pool pool_slot renderer saved_state state_header
  thread_pool)
