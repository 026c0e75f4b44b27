walker_sim_sources(core_sources network policy safetensors)
# -fno-trapping-math lets the compiler vectorise tanh.
set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/network.cpp PROPERTIES
  SKIP_PRECOMPILE_HEADERS ON COMPILE_OPTIONS -fno-trapping-math)
