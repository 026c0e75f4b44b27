walker_sim_sources(core_sources agent registry)
# Only registry.cpp gets the version: one compiler cache serves the other files of every build.
set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/registry.cpp PROPERTIES
  COMPILE_DEFINITIONS "WALKER_SIM_VERSION=\"${PROJECT_VERSION}\"")
# A folder each, which lists its own files.
file(GLOB robot_lists CONFIGURE_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/*/sources.cmake)
foreach(robot_list ${robot_lists})
  include(${robot_list})
endforeach()
