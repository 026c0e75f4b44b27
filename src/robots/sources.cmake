walker_sim_sources(core_sources agent registry robot)
# The version goes to the file that returns it: the others are compiled alike for all engines, with ROS and
# without, so that a compiler cache serves every build.
set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/registry.cpp PROPERTIES
  COMPILE_DEFINITIONS "WALKER_SIM_VERSION=\"${PROJECT_VERSION}\"")
# A folder each, which lists its own files.
file(GLOB robot_lists CONFIGURE_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/*/sources.cmake)
foreach(robot_list ${robot_lists})
  include(${robot_list})
endforeach()
