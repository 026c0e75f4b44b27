walker_sim_sources(core_sources agent registry robot)
# The version goes to the file that returns it: the others are compiled alike for all engines, with ROS and
# without, so that a compiler cache serves every build.
set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/registry.cpp PROPERTIES
  COMPILE_DEFINITIONS "WALKER_SIM_VERSION=\"${PROJECT_VERSION}\"")
include(${CMAKE_CURRENT_LIST_DIR}/bipedal_walker/sources.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/mujoco/sources.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/walker2d/sources.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/hopper/sources.cmake)
