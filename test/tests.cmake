# Tests and benchmarks, not part of `all`. A test is named after its path below test/, with _ for /, and
# has these labels:
#   short  ./scripts/test runs it; the target `short_tests` builds what it needs
#   long   ./scripts/test --all runs it as well
#   nightly  ./scripts/test --nightly runs it
#   devel  ./scripts/test --all leaves it out, see ros_tests.cmake
# A gtest that needs no master also has the label `unit`; `unit_tests` builds these. `tests` builds all
# tests, `benchmarks` the programs that ./scripts/bench calls.
set(test_results ${CMAKE_BINARY_DIR}/test_results/walker_sim)
add_custom_target(short_tests)
add_custom_target(unit_tests)
add_custom_target(benchmarks)

# walker_sim_label(NAME LABEL TARGET...): sets the test's label and what must be built for it.
function(walker_sim_label name label)
  set_tests_properties(${name} PROPERTIES LABELS "${label}")
  # Ends a hanging test. scripts/test sets a longer timeout for instrumented unit tests.
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

# walker_sim_register_gtest(NAME PROGRAM LABEL ARGUMENT...): adds a run of a gtest program as a test.
function(walker_sim_register_gtest name program label)
  set(results ${test_results}/gtest-${name}.xml)
  string(JOIN " " command $<TARGET_FILE:${program}> ${ARGN} --gtest_output=xml:${results})
  catkin_run_tests_target(gtest ${name} gtest-${name}.xml DEPENDENCIES ${program} COMMAND ${command})
  walker_sim_label(_ctest_${PROJECT_NAME}_gtest_${name} "${label};unit" ${program})
  add_dependencies(unit_tests ${program})
endfunction()

# -O1 halves the compile time of the test programs. The code under test keeps its own options.
set(test_options -O1)
if(WALKER_SIM_INSTRUMENT STREQUAL "address")
  list(APPEND test_options -Wno-maybe-uninitialized) # a false positive of GCC 12 in std::regex
endif()

# walker_sim_add_unit_tests(ROOM LIBRARIES LIBRARY... [WITH ROOM...] [ALSO FILE...] [LEFT_OUT NAME...]):
# links *_test.cpp below test/ROOM, below the WITH folders, and the ALSO files into one program, because
# linking takes longer than testing. The program for a/b is b_tests. Files of rostests and LEFT_OUT files
# are excluded. Each file is one test and runs in its own process.
function(walker_sim_add_unit_tests room)
  cmake_parse_arguments(add "" "" "LIBRARIES;WITH;ALSO;LEFT_OUT" ${ARGN})
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
    walker_sim_register_gtest(${test} ${program} short --file=${name}.cpp)
  endforeach()
endfunction()

# The core's unit tests link its objects, because the library hides most symbols.
set(core_libraries walker_sim_core_objects walker_sim_pictures)
walker_sim_add_unit_tests(base LIBRARIES ${core_libraries} WITH simd)
walker_sim_add_unit_tests(client LIBRARIES ${core_libraries} WITH wire LEFT_OUT service_types_test)
walker_sim_add_unit_tests(drawing LIBRARIES walker_sim_drawing ${core_libraries})
walker_sim_add_unit_tests(policy LIBRARIES ${core_libraries})

set(left_out pool_race_test) # a separate program, see below
if(WALKER_SIM_INSTRUMENT)
  set(left_out small_stack_test) # instrumented functions need a larger stack
endif()
walker_sim_add_unit_tests(episode LIBRARIES ${core_libraries} WITH promises LEFT_OUT ${left_out}
  ALSO test/robots/agent_test.cpp test/robots/registry_test.cpp test/robots/sensor_noise_test.cpp)

# Prints the traces that test/promises expects of Python's interfaces.
add_executable(walker_sim_oracle EXCLUDE_FROM_ALL test/promises/oracle.cpp)
target_include_directories(walker_sim_oracle PRIVATE test)
target_compile_definitions(walker_sim_oracle PRIVATE WALKER_SIM_SOURCE_DIR="${CMAKE_CURRENT_SOURCE_DIR}")
target_link_libraries(walker_sim_oracle PRIVATE ${core_libraries} walker_sim_flags GTest::GTest
  Threads::Threads ${CMAKE_DL_LIBS})

set(left_out "")
if(NOT bipedal_walker_kernels)
  set(left_out kernel_test rotation_test)
endif()
walker_sim_add_unit_tests(robots/bipedal_walker LIBRARIES ${core_libraries} LEFT_OUT ${left_out})

set(left_out "")
if(NOT walker2d_kernels)
  list(APPEND left_out kernel_physics_test kernel_test kernel_check_test)
endif()
walker_sim_add_unit_tests(robots/mujoco LIBRARIES ${core_libraries} WITH robots/hopper robots/walker2d
  LEFT_OUT ${left_out})

# walker_sim_register_variant(NAME PROGRAM FILE LABEL VARIABLE=VALUE...): adds a test that runs a FILE of
# PROGRAM again with other environment variables. Nightly variants run more inputs through the same code and
# would take hours in instrumented builds, which leave them out.
function(walker_sim_register_variant name program file label)
  if(WALKER_SIM_INSTRUMENT AND label STREQUAL "nightly")
    return()
  endif()
  walker_sim_register_gtest(${name} ${program} ${label} --file=${file}.cpp)
  set_tests_properties(_ctest_${PROJECT_NAME}_gtest_${name} PROPERTIES ENVIRONMENT "${ARGN}")
endfunction()

if(walker2d_kernels)
  # Repeats the recordings without Walker2d's kernel, and with the kernel that every processor supports.
  foreach(kernel off sse2)
    walker_sim_register_variant(robots_mujoco_recordings_test_kernel_${kernel}
      mujoco_tests recordings_test short WALKER_SIM_KERNEL=${kernel})
  endforeach()
  walker_sim_register_variant(robots_mujoco_kernel_kernel_test_long
    mujoco_tests kernel_test nightly WALKER_SIM_TEST_STEPS=30000)
  walker_sim_register_variant(robots_mujoco_world_levels_test_long
    mujoco_tests world_levels_test nightly WALKER_SIM_TEST_STEPS=1000000)
  foreach(name altered_add altered_pow)
    set_source_files_properties(test/robots/mujoco/kernel/${name}.cpp PROPERTIES
      SKIP_PRECOMPILE_HEADERS ON COMPILE_OPTIONS "${mujoco_kernel_options}")
    target_sources(mujoco_tests PRIVATE test/robots/mujoco/kernel/${name}.cpp)
  endforeach()
endif()
target_sources(mujoco_tests PRIVATE test/robots/mujoco/kernel/run.cpp)
if(bipedal_walker_kernels)
  # Box2D alone also has the recordings' bits.
  walker_sim_register_variant(robots_bipedal_walker_recordings_test_kernel_off
    bipedal_walker_tests recordings_test short WALKER_SIM_KERNEL=off)
  set(shards 7) # not a multiple of 4, because every fourth case is the longest
  foreach(shard RANGE 1 ${shards})
    math(EXPR index "${shard} - 1")
    walker_sim_register_variant(robots_bipedal_walker_kernel_kernel_test_long_${shard}
      bipedal_walker_tests kernel_test nightly
      WALKER_SIM_TEST_STEPS=100000 GTEST_TOTAL_SHARDS=${shards} GTEST_SHARD_INDEX=${index})
  endforeach()
  walker_sim_register_variant(robots_bipedal_walker_kernel_rotation_test_long
    bipedal_walker_tests rotation_test nightly WALKER_SIM_TEST_ALL_ANGLES=1)
endif()
# Without optimisation, this comparison would take longer than the steps.
set_source_files_properties(test/robots/bipedal_walker/kernel/world_words.cpp PROPERTIES
  SKIP_PRECOMPILE_HEADERS ON COMPILE_OPTIONS "-O3;-fno-access-control")
target_sources(bipedal_walker_tests PRIVATE test/robots/bipedal_walker/kernel/world_words.cpp)
set_source_files_properties(test/robots/bipedal_walker/box2d_pinned/swept_vertices_test.cpp PROPERTIES
  SKIP_PRECOMPILE_HEADERS ON COMPILE_OPTIONS -fno-access-control)
if(NOT WALKER_SIM_INSTRUMENT) # ThreadSanitizer also runs promises_test
  include(test/episode/race_test.cmake)
endif()

include(test/fuzz/fuzz.cmake)

foreach(name benchmark ping_pong)
  add_executable(walker_sim_${name} EXCLUDE_FROM_ALL test/bench/${name}.cpp)
  target_include_directories(walker_sim_${name} PRIVATE test)
  target_link_libraries(walker_sim_${name} PRIVATE walker_sim_core_objects Threads::Threads ${CMAKE_DL_LIBS})
  list(APPEND benchmark_tools walker_sim_${name})
endforeach()
foreach(name lockstep_roscpp null_server)
  add_executable(walker_sim_${name} EXCLUDE_FROM_ALL test/bench/${name}.cpp)
  target_include_directories(walker_sim_${name} PRIVATE test)
  target_link_libraries(walker_sim_${name} PRIVATE walker_sim_server walker_sim_flags)
  list(APPEND benchmark_tools walker_sim_${name})
endforeach()
add_dependencies(benchmarks ${benchmark_tools} ${node_targets} ${PROJECT_NAME}_generate_messages_py)
if(WALKER_SIM_PYTHON)
  add_dependencies(benchmarks walker_sim_python)
endif()

include(test/ros_tests.cmake)
if(WALKER_SIM_TEST_PYTHON)
  include(test/python_tests.cmake)
  if(NOT WALKER_SIM_INSTRUMENT)
    include(test/stages.cmake)
  endif()
endif()
