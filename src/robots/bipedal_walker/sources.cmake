walker_sim_sources(core_sources
  bipedal_walker canvas heuristic kernel/kernel kernel/trial lidar observation observation_builder
  physics registration renderer reward saved_state specification terrain)
list(APPEND core_sources ${box2d_room_sources} ${bipedal_walker_kernels})
set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/specification.cpp PROPERTIES
  COMPILE_DEFINITIONS "WALKER_SIM_BOX2D_ORIGIN=\" (${box2d_origin})\"")
