# Python suites, test/NAME.py, which run in the devel space if there is one. They compare with the NumPy
# and Gymnasium of WALKER_SIM_TEST_PYTHON. Included by tests.cmake.
set(short_suites
  base/exported_symbols_test
  simd/symbols_test
  base/random_numpy_test
  episode/worlds_numpy_test
  docs_test
  exports_test
  package_xml_test
  repository_test
  python/answers_test
  python/bad_input_test
  python/environment_test
  python/environment_threads_test
  python/keywords_test
  python/package_test
  python/promises_ros_test
  python/promises_test
  python/recorded_pictures_test
  python/refusals_ros_test
  python/signals_test
  python/vector_arguments_test
  python/vector_environment_test
  python/worlds_ros_test
  python/worlds_test)
# Each takes about a minute. They start early, so that none runs alone at the end.
set(slow_suites bench/bench_test python/promises_test python/promises_ros_test robots/bipedal_walker/episodes_gymnasium_test
  robots/mujoco/episodes_gymnasium_test robots/mujoco/renderer_gymnasium_test
  robots/bipedal_walker/renderer_gymnasium_test python/environment_memory_test python/environment_render_test readme_test)
# stages.cmake runs these in separate virtual environments.
set(other_suites python/curriculum_test python/history_test python/minari_test python/normalization_test
  python/onnx_reader_test python/onnx_test python/readme_wheel_test python/rosnodejs_test python/sb3_make_vec_env_test
  python/sb3_models_test python/sb3_promises_test python/sb3_test python/sb3_worlds_test python/torch_test
  python/train_test python/web_ros_test python/web_server_test python/web_test python/wheel_test)

add_library(walker_sim_c_interface MODULE EXCLUDE_FROM_ALL test/c_interface.cpp)
target_include_directories(walker_sim_c_interface PRIVATE test)
target_link_libraries(walker_sim_c_interface PRIVATE walker_sim_core walker_sim_flags)
set_target_properties(walker_sim_c_interface PROPERTIES INSTALL_RPATH "$ORIGIN")
add_library(walker_sim_draws MODULE EXCLUDE_FROM_ALL test/draws.cpp)
target_include_directories(walker_sim_draws PRIVATE test)
target_link_libraries(walker_sim_draws PRIVATE walker_sim_core_objects walker_sim_flags Threads::Threads
  ${CMAKE_DL_LIBS})

string(CONCAT suite_environment
  "PYTHONDONTWRITEBYTECODE=1"
  ";WALKER_SIM_DRAWS=$<TARGET_FILE:walker_sim_draws>"
  ";WALKER_SIM_CORE_LIBRARY=$<TARGET_FILE:walker_sim_core>"
  ";WALKER_SIM_C_INTERFACE=$<TARGET_FILE:walker_sim_c_interface>"
  ";WALKER_SIM_KERNEL_OBJECTS="
  "$<JOIN:$<FILTER:$<TARGET_OBJECTS:walker_sim_core_objects>,INCLUDE,kernel_(sse2|avx2|avx512)>,:>"
  ";WALKER_SIM_PROGRAMS=$<TARGET_FILE_DIR:walker_sim_benchmark>")

function(walker_sim_add_suite path)
  string(REPLACE "/" "_" name ${path})
  add_test(NAME ${name} COMMAND ${CATKIN_ENV} ${WALKER_SIM_TEST_PYTHON} -m pytest -q
    -p no:cacheprovider ${CMAKE_CURRENT_SOURCE_DIR}/test/${path}.py)
  set_tests_properties(${name} PROPERTIES ENVIRONMENT "${suite_environment}")
  set(label long)
  if(path IN_LIST short_suites)
    set(label short)
  endif()
  if(path IN_LIST slow_suites)
    set_tests_properties(${name} PROPERTIES COST 1)
  endif()
  set(tools walker_sim_python walker_sim_c_interface walker_sim_core walker_sim_draws walker_sim_oracle)
  if(path STREQUAL "bench/bench_test")
    list(APPEND tools benchmarks)
  endif()
  walker_sim_label(${name} ${label} ${tools})
  if(path MATCHES promises)
    set_tests_properties(${name} PROPERTIES TIMEOUT 1500)
  endif()
endfunction()

file(GLOB_RECURSE suites CONFIGURE_DEPENDS
  RELATIVE ${CMAKE_CURRENT_SOURCE_DIR}/test test/*_test.py)
list(FILTER suites EXCLUDE REGEX "^(agents|examples|launch|nodes|scripts|server)/")
foreach(suite ${suites})
  string(REGEX REPLACE "\\.py$" "" path ${suite})
  if(path IN_LIST other_suites
    OR (NOT WALKER_SIM_PYTHON AND path MATCHES "^python/")
    OR (WALKER_SIM_INSTRUMENT AND NOT path MATCHES "^python/")) # others repeat code, or inspect files
    continue()
  endif()
  walker_sim_add_suite(${path})
endforeach()
if(TEST soak_soak_test)
  # Its timeouts are in seconds, so it runs alone.
  set_tests_properties(soak_soak_test PROPERTIES RUN_SERIAL TRUE TIMEOUT 900)
  walker_sim_label(soak_soak_test long walker_sim_nodes)
endif()
