walker_sim_sources(core_sources
  environment episode_record episode_recorder episode_rules failure parking pool pool_members
  renderer state_header thread_pool)
