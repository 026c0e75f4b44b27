walker_sim_sources(core_sources agent registry robot)
# Only registry.cpp gets the version: one compiler cache serves the other files of every build.
set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/registry.cpp PROPERTIES
  COMPILE_DEFINITIONS "WALKER_SIM_VERSION=\"${PROJECT_VERSION}\"")
foreach(folder bipedal_walker mujoco walker2d hopper)
  include(${CMAKE_CURRENT_LIST_DIR}/${folder}/sources.cmake)
endforeach()
