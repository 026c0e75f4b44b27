# Unit tests of the server, tests of launch files and scripts, and rostests: test/NAME.test, or
# test/ros_test.launch without one, starts a master and runs test/NAME.py or the gtest test/NAME.cpp.
# Included by tests.cmake.

walker_sim_add_unit_tests(server
  LIBRARIES walker_sim_replay walker_sim_agents walker_sim_server ${urdf_LIBRARIES}
  WITH description replay ros
  ALSO test/client/service_types_test.cpp)
target_include_directories(server_tests SYSTEM PRIVATE ${urdf_INCLUDE_DIRS})

foreach(path launch/launch_test nodes/describe_test nodes/view_test scripts/choose_master_test
    scripts/dev/check_release_test scripts/dev/debian_test scripts/dev/lock_test scripts/dev/make_meshes_test scripts/setup_test)
  string(REPLACE "/" "_" name ${path})
  catkin_run_tests_target(pytest ${name} pytest-${name}.xml DEPENDENCIES walker_sim_nodes
    COMMAND "${PYTHON_EXECUTABLE} -m pytest -q -p no:cacheprovider --junit-xml=${test_results}/pytest-${name}.xml ${CMAKE_CURRENT_SOURCE_DIR}/test/${path}.py")
  walker_sim_label(_ctest_${PROJECT_NAME}_pytest_${name} short walker_sim_nodes)
endforeach()

# Short rostests: one per mode of use, in C++ and in Python.
set(short_rostests
  agents/robot_test
  client/episodes_test
  server/free_test
  server/gazebo_test
  server/lockstep_test
  server/namespaces_test
  server/promises_test
  server/publish_order_test
  server/records_test
  server/transport/lockstep_cost_test
  server/world_services_test)
# These measure wall time, so each runs alone.
set(timed_rostests
  server/pace_test
  server/ten_walkers_test)

# walker_sim_add_rostest(PATH): adds two tests of test/PATH.py or .cpp. NAME runs against the devel space,
# with label devel, and if it is short also short; install_NAME against stages.cmake's install space, with
# label long. ./scripts/test --all leaves out the label devel, because install_NAME tests the same.
function(walker_sim_add_rostest path)
  string(REPLACE "/" "_" name ${path})
  set(test _ctest_${PROJECT_NAME}_rostest_test_${name}.test)
  set(launch_file test/${path}.test)
  set(arguments "")
  if(NOT EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/${launch_file})
    set(test _ctest_${PROJECT_NAME}_rostest_ros_test__path_${name}.launch)
    set(launch_file test/ros_test.launch)
    set(arguments path:=${path})
  endif()
  add_rostest(${launch_file} ARGS ${arguments} DEPENDENCIES walker_sim_nodes)
  set(label devel)
  if(path IN_LIST short_rostests)
    set(label "short;devel")
  endif()
  set(program walker_sim_oracle) # server/promises_test runs it
  if(EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/test/${path}.cpp)
    set(program ros_tests)
    file(STRINGS test/${path}.cpp own_main REGEX "^int main")
    if(own_main)
      set(program ${name})
      walker_sim_add_ros_program(${name} test/${path}.cpp)
    else()
      target_sources(ros_tests PRIVATE test/${path}.cpp)
    endif()
  endif()
  walker_sim_label(${test} "${label}" walker_sim_nodes ${program})
  set(tests ${test})
  if(NOT WALKER_SIM_INSTRUMENT) # instrumented builds are not installed
    add_test(NAME install_${name} COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/test/stage.sh installed rostest
      ${CMAKE_CURRENT_SOURCE_DIR}/${launch_file} ${arguments})
    walker_sim_label(install_${name} long ${program})
    set_tests_properties(install_${name} PROPERTIES FIXTURES_REQUIRED install_space)
    list(APPEND tests install_${name})
  endif()
  if(path MATCHES promises)
    set_tests_properties(${tests} PROPERTIES TIMEOUT 1500)
  endif()
  set_tests_properties(${tests} PROPERTIES ENVIRONMENT
    "WALKER_SIM_PROGRAMS=$<TARGET_FILE_DIR:walker_sim_oracle>")
  if(path IN_LIST timed_rostests)
    set_tests_properties(${tests} PROPERTIES RUN_SERIAL TRUE)
  endif()
endfunction()

function(walker_sim_add_ros_program name)
  add_executable(${name} EXCLUDE_FROM_ALL ${ARGN})
  target_include_directories(${name} PRIVATE test)
  target_compile_definitions(${name} PRIVATE WALKER_SIM_SOURCE_DIR="${CMAKE_CURRENT_SOURCE_DIR}")
  target_compile_options(${name} PRIVATE ${test_options})
  target_link_libraries(${name} PRIVATE walker_sim_agents walker_sim_server walker_sim_flags
    GTest::GTest)
  walker_sim_compile_as(walker_sim_agents ${name})
endfunction()

# Gtests without a main of their own are linked into one program. roslaunch finds the tests in Python by
# a link in the devel space: in the source tree, it might find another build's copy.
walker_sim_add_ros_program(ros_tests test/ros_test_main.cpp)
set(programs ${CATKIN_DEVEL_PREFIX}/${CATKIN_PACKAGE_BIN_DESTINATION})
file(MAKE_DIRECTORY ${programs})
file(CREATE_LINK ${CMAKE_CURRENT_SOURCE_DIR}/test/ros_test_main.py ${programs}/ros_test_main.py SYMBOLIC)
file(GLOB_RECURSE files CONFIGURE_DEPENDS RELATIVE ${CMAKE_CURRENT_SOURCE_DIR}/test
  test/*.test test/agents/*_test.py test/server/*_test.py)
list(TRANSFORM files REPLACE "\\.(py|test)$" "" OUTPUT_VARIABLE paths)
list(REMOVE_DUPLICATES paths)
foreach(path ${paths})
  walker_sim_add_rostest(${path})
endforeach()
