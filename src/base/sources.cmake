walker_sim_sources(core_sources
  checks interruption pacer parameter_text parameters printable_text random shared_library)
