# The program that compiles models of users, and the ways to it from the files that have the core's code.
add_executable(walker_sim_compile_model src/robots/mujoco/compile_model.cpp)
target_include_directories(walker_sim_compile_model PRIVATE src)
target_link_libraries(walker_sim_compile_model PRIVATE walker_sim_mujoco walker_sim_flags)
set_target_properties(walker_sim_compile_model PROPERTIES OUTPUT_NAME compile_model)
set(ways_to_programs "\".\"") # programs, and in the wheel the Python extension, are beside it
if(WALKER_SIM_ROS)
  # The devel space has MuJoCo beside the libraries, the install space beside the program.
  set_target_properties(walker_sim_compile_model PROPERTIES
    INSTALL_RPATH "$ORIGIN;$ORIGIN/${way_to_libraries}")
  foreach(folder ${CATKIN_PACKAGE_LIB_DESTINATION} ${CATKIN_PACKAGE_PYTHON_DESTINATION})
    file(RELATIVE_PATH way /${folder} /${CATKIN_PACKAGE_BIN_DESTINATION})
    string(APPEND ways_to_programs ", \"${way}\"")
  endforeach()
else()
  set_target_properties(walker_sim_compile_model PROPERTIES INSTALL_RPATH "$ORIGIN"
    RUNTIME_OUTPUT_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/python/walker_sim)
endif()
set_source_files_properties(src/robots/mujoco/compile_apart.cpp PROPERTIES
  COMPILE_DEFINITIONS "WALKER_SIM_WAYS_TO_PROGRAMS=${ways_to_programs}")
add_dependencies(walker_sim_core_objects walker_sim_compile_model)
