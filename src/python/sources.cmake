walker_sim_sources(python_sources arrays client conversions environment module policy pool renderer)
