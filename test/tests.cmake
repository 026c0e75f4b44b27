# Tests and benchmarks, none of them in `all`. Every test has a label: `short`, what ./scripts/test
# runs, built by the target `short_tests`; `long`, what ./scripts/test --all runs on top; or `devel`,
# which ros_tests.cmake explains. Gtests without a master have the label `unit` too, and the target
# `unit_tests`. The target `tests` builds all, `benchmarks` what ./scripts/bench calls.
set(test_results ${CMAKE_BINARY_DIR}/test_results/walker_sim)
if(WALKER_SIM_ROS)
  find_package(tf2 REQUIRED)
else()
  enable_testing()
  add_custom_target(tests)
endif()
add_custom_target(short_tests)
add_custom_target(unit_tests)
add_custom_target(benchmarks)

# walker_sim_label(NAME LABEL TARGET...): the test's label, and what has to be built for it.
function(walker_sim_label name label)
  set_tests_properties(${name} PROPERTIES LABELS "${label}")
  # It ends what hangs, on busy machines too. Instrumented units have the longer one of scripts/test.
  if("long" IN_LIST label OR ("unit" IN_LIST label AND NOT WALKER_SIM_INSTRUMENT))
    set_tests_properties(${name} PROPERTIES TIMEOUT 1500)
  endif()
  if(ARGN)
    add_dependencies(tests ${ARGN})
    if("short" IN_LIST label)
      add_dependencies(short_tests ${ARGN})
    endif()
  endif()
endfunction()

# walker_sim_register_gtest(NAME PROGRAM LABEL ARGUMENT...): a run of a program of gtests.
function(walker_sim_register_gtest name program label)
  set(results ${test_results}/gtest-${name}.xml)
  if(WALKER_SIM_ROS)
    string(JOIN " " command $<TARGET_FILE:${program}> ${ARGN} --gtest_output=xml:${results})
    catkin_run_tests_target(gtest ${name} gtest-${name}.xml DEPENDENCIES ${program} COMMAND ${command})
    set(name _ctest_${PROJECT_NAME}_gtest_${name})
  else()
    add_test(NAME ${name} COMMAND ${program} ${ARGN} --gtest_output=xml:${results})
  endif()
  walker_sim_label(${name} "${label};unit" ${program})
  add_dependencies(unit_tests ${program})
endfunction()

# Test programs are compiled with little optimisation, in half the time: what they test is not.
set(test_options -O1)
if(WALKER_SIM_INSTRUMENT STREQUAL "address")
  list(APPEND test_options -Wno-maybe-uninitialized) # which GCC 12 says of std::regex there, and wrongly
endif()

# To those alone that ask for it; the others are compiled once for all engines, where there is a cache.
if(WALKER_SIM_ENGINES STREQUAL "pinned")
  set_source_files_properties(test/robots/bipedal_walker/episodes_test.cpp
    test/robots/bipedal_walker/renderer_test.cpp test/robots/bipedal_walker/specification_test.cpp
    test/robots/bipedal_walker/statistics_test.cpp test/robots/mujoco/specification_test.cpp
    PROPERTIES COMPILE_DEFINITIONS WALKER_SIM_ENGINES_PINNED)
endif()

# ---------------------------------------------------------------- units: gtests, a program a room
# walker_sim_add_unit_tests(ROOM LIBRARIES LIBRARY... [WITH ROOM...] [ALSO FILE...] [LONG NAME...]
# [LEFT_OUT NAME...]): all NAME.cpp below test/ROOM, and below those of WITH, but those of a rostest are
# one program, ROOM_tests, as linking takes longer than testing. Each file is a test of its own and runs
# alone, in a process that no other has touched.
function(walker_sim_add_unit_tests room)
  cmake_parse_arguments(add "" "" "LIBRARIES;WITH;ALSO;LONG;LEFT_OUT" ${ARGN})
  set(files "")
  foreach(folder ${room} ${add_WITH})
    file(GLOB_RECURSE found CONFIGURE_DEPENDS RELATIVE ${CMAKE_CURRENT_SOURCE_DIR}
      test/${folder}/*_test.cpp)
    list(APPEND files ${found})
  endforeach()
  get_filename_component(program ${room}_tests NAME)
  set(chosen "")
  foreach(file ${files} ${add_ALSO})
    get_filename_component(name ${file} NAME_WE)
    string(REGEX REPLACE "cpp$" "test" rostest ${file})
    if(NOT EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/${rostest} AND NOT name IN_LIST add_LEFT_OUT)
      list(APPEND chosen ${file})
    endif()
  endforeach()
  add_executable(${program} EXCLUDE_FROM_ALL test/unit_test_main.cpp ${chosen})
  target_include_directories(${program} PRIVATE test)
  target_compile_options(${program} PRIVATE ${test_options})
  target_compile_definitions(${program} PRIVATE
    WALKER_SIM_RECORDINGS="${CMAKE_CURRENT_SOURCE_DIR}/test/recordings"
    WALKER_SIM_SOURCE_DIR="${CMAKE_CURRENT_SOURCE_DIR}")
  target_link_libraries(${program} PRIVATE ${add_LIBRARIES} walker_sim_flags GTest::GTest
    Threads::Threads ${CMAKE_DL_LIBS})
  if(room STREQUAL "base")
    target_precompile_headers(${program} PRIVATE <gtest/gtest.h> <algorithm> <array> <cmath>
      <functional> <map> <memory> <optional> <stdexcept> <string> <thread> <vector>)
  elseif(walker_sim_server IN_LIST add_LIBRARIES)
    walker_sim_compile_as(walker_sim_agents ${program})
  else()
    target_precompile_headers(${program} REUSE_FROM base_tests)
  endif()
  foreach(file ${chosen})
    get_filename_component(name ${file} NAME_WE)
    string(REGEX REPLACE "^test/(.*)\\.cpp$" "\\1" test ${file})
    string(REPLACE "/" "_" test ${test})
    set(label short)
    if(name IN_LIST add_LONG)
      set(label long)
    endif()
    walker_sim_register_gtest(${test} ${program} ${label} --file=${name}.cpp)
  endforeach()
endfunction()

# These link the core's objects, so that they also reach what the library hides. BipedalWalker's bits
# are the pinned Box2D's; with another one statistics_test is what remains.
set(core_libraries walker_sim_core_objects walker_sim_pictures)
set(not_these_engines "")
if(NOT WALKER_SIM_ENGINES STREQUAL "pinned")
  set(not_these_engines block_allocator_test recordings_test saved_state_test swept_vertices_test
    world_state_test)
endif()
set(not_in_this_build pool_race_test)
if(WALKER_SIM_INSTRUMENT)
  set(not_in_this_build small_stack_test) # functions take more of the stack there
endif()
walker_sim_add_unit_tests(base LIBRARIES ${core_libraries} WITH simd)
walker_sim_add_unit_tests(episode LIBRARIES ${core_libraries} LEFT_OUT ${not_in_this_build}
  ALSO test/robots/agent_test.cpp test/robots/registry_test.cpp)
walker_sim_add_unit_tests(client LIBRARIES ${core_libraries} WITH wire LEFT_OUT service_types_test)
walker_sim_add_unit_tests(policy LIBRARIES ${core_libraries})
set(for_other_processors "")
if(NOT bipedal_walker_kernels)
  set(for_other_processors kernel_test rotation_test trial_test)
endif()
walker_sim_add_unit_tests(robots/bipedal_walker LIBRARIES ${core_libraries}
  LEFT_OUT shortcuts_test ${not_these_engines} ${for_other_processors})
set(for_other_processors "")
if(NOT walker2d_kernels)
  set(for_other_processors kernel_group_test kernel_physics_test kernel_test trial_test)
endif()
walker_sim_add_unit_tests(robots/mujoco LIBRARIES ${core_libraries} WITH robots/hopper robots/walker2d
  LEFT_OUT ${for_other_processors})
# walker_sim_register_variant(NAME ROOM FILE LABEL VARIABLE...): a file of a room's tests again, in
# another environment. What is long there takes other numbers on the same ways through the code, and hours
# where that is instrumented.
function(walker_sim_register_variant name room file label)
  if(WALKER_SIM_INSTRUMENT AND label STREQUAL "long")
    return()
  endif()
  walker_sim_register_gtest(${name} ${room}_tests ${label} --file=${file}.cpp)
  if(WALKER_SIM_ROS)
    set(name _ctest_${PROJECT_NAME}_gtest_${name})
  endif()
  set_tests_properties(${name} PROPERTIES ENVIRONMENT "${ARGN}")
endfunction()

if(walker2d_kernels)
  # Every recorded episode without Walker2d's kernel, too, and with the one that all processors can run.
  foreach(kernel off sse2)
    walker_sim_register_variant(robots_mujoco_recordings_test_kernel_${kernel} mujoco recordings_test short
      WALKER_SIM_KERNEL=${kernel})
  endforeach()
  walker_sim_register_variant(robots_walker2d_kernel_kernel_test_long mujoco kernel_test long
    WALKER_SIM_TEST_STEPS=30000)
  foreach(name altered_add altered_pow)
    set_source_files_properties(test/robots/walker2d/kernel/${name}.cpp PROPERTIES
      SKIP_PRECOMPILE_HEADERS ON COMPILE_OPTIONS "${walker2d_kernel_options}")
    target_sources(mujoco_tests PRIVATE test/robots/walker2d/kernel/${name}.cpp)
  endforeach()
  target_sources(mujoco_tests PRIVATE test/robots/walker2d/kernel/run.cpp)
endif()
if(bipedal_walker_kernels)
  set(shards 7) # not a multiple of 4: every fourth of its cases is the longest
  foreach(shard RANGE 1 ${shards})
    math(EXPR index "${shard} - 1")
    walker_sim_register_variant(robots_bipedal_walker_kernel_kernel_test_long_${shard} bipedal_walker
      kernel_test long WALKER_SIM_TEST_STEPS=100000 GTEST_TOTAL_SHARDS=${shards}
      GTEST_SHARD_INDEX=${index})
  endforeach()
  walker_sim_register_variant(robots_bipedal_walker_kernel_rotation_test_long bipedal_walker rotation_test long
    WALKER_SIM_TEST_ALL_ANGLES=1)
  target_sources(bipedal_walker_tests PRIVATE test/robots/bipedal_walker/kernel/run.cpp)
endif()
if(WALKER_SIM_ENGINES STREQUAL "pinned")
  # The comparison takes longer than the steps.
  set_source_files_properties(test/robots/bipedal_walker/kernel/world_words.cpp PROPERTIES
    SKIP_PRECOMPILE_HEADERS ON COMPILE_OPTIONS "-O3;-fno-access-control")
  target_sources(bipedal_walker_tests PRIVATE test/robots/bipedal_walker/kernel/world_words.cpp)
  set_source_files_properties(test/robots/bipedal_walker/box2d_pinned/swept_vertices_test.cpp PROPERTIES
    SKIP_PRECOMPILE_HEADERS ON COMPILE_OPTIONS -fno-access-control)
  if(NOT WALKER_SIM_INSTRUMENT) # programs whose code is that of the other tests
    include(test/robots/bipedal_walker/shortcuts.cmake)
    include(test/episode/race_test.cmake)
  endif()
endif()

# ---------------------------------------------------------------- what bytes from outside may be
include(test/fuzz/fuzz.cmake)

# ---------------------------------------------------------------- programs that tests and benchmarks call
# They step environments for the comparison with Gymnasium, which drives them through a pipe.
foreach(program rollout episode/pool_rollout)
  get_filename_component(name ${program} NAME)
  add_executable(walker_sim_${name} EXCLUDE_FROM_ALL test/${program}.cpp)
  list(APPEND core_tools walker_sim_${name})
endforeach()
foreach(name batch_client benchmark ping_pong)
  add_executable(walker_sim_${name} EXCLUDE_FROM_ALL test/bench/${name}.cpp)
  list(APPEND benchmark_tools walker_sim_${name})
endforeach()
foreach(tool ${core_tools} ${benchmark_tools})
  target_include_directories(${tool} PRIVATE test)
  target_link_libraries(${tool} PRIVATE walker_sim_core_objects Threads::Threads ${CMAKE_DL_LIBS})
endforeach()
if(WALKER_SIM_ROS)
  foreach(name lockstep_client null_server)
    add_executable(walker_sim_${name} EXCLUDE_FROM_ALL test/bench/${name}.cpp)
    target_include_directories(walker_sim_${name} PRIVATE test)
    target_link_libraries(walker_sim_${name} PRIVATE walker_sim_server walker_sim_flags)
    list(APPEND benchmark_tools walker_sim_${name})
  endforeach()
  add_dependencies(benchmarks ${node_targets} ${PROJECT_NAME}_generate_messages_py)
endif()
add_dependencies(benchmarks ${benchmark_tools})
if(WALKER_SIM_PYTHON)
  add_dependencies(benchmarks walker_sim_python)
endif()

if(WALKER_SIM_ROS)
  include(test/ros_tests.cmake)
endif()
if(WALKER_SIM_TEST_PYTHON)
  include(test/python_tests.cmake)
  if(WALKER_SIM_ROS AND NOT WALKER_SIM_INSTRUMENT)
    include(test/stages.cmake)
  endif()
endif()
