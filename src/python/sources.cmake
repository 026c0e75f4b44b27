walker_sim_sources(python_sources client conversions environment module policy pool)
