# episode_pool_race_test: the pool's threads under ThreadSanitizer. The core and Box2D are compiled
# again with instrumentation, from the same sources with the same options; MuJoCo is not.
function(walker_sim_add_race_copy target)
  # Leaves out the unity sources and the precompiled header that CMake has added.
  add_library(${target}_race OBJECT EXCLUDE_FROM_ALL
    $<FILTER:$<TARGET_PROPERTY:${target},SOURCES>,EXCLUDE,unity_|cmake_pch>)
  # SYSTEM silences warnings in the engines' headers; the original target reports those in ours.
  target_include_directories(${target}_race
    SYSTEM PRIVATE $<TARGET_PROPERTY:${target},INCLUDE_DIRECTORIES>)
  target_compile_definitions(${target}_race
    PRIVATE $<TARGET_PROPERTY:${target},COMPILE_DEFINITIONS>)
  target_compile_options(${target}_race
    PRIVATE $<TARGET_PROPERTY:${target},COMPILE_OPTIONS> -fsanitize=thread -g)
endfunction()

walker_sim_add_race_copy(box2d_pinned)
set_target_properties(box2d_pinned_race PROPERTIES UNITY_BUILD ON)
walker_sim_add_race_copy(walker_sim_core_objects)
# Otherwise Make may generate a header for both targets at the same time.
add_dependencies(walker_sim_core_objects_race walker_sim_core_objects)

add_executable(episode_pool_race_test EXCLUDE_FROM_ALL
  test/unit_test_main.cpp test/episode/thread_pool_test.cpp test/episode/pool_race_test.cpp)
target_include_directories(episode_pool_race_test PRIVATE include src test)
target_compile_options(episode_pool_race_test PRIVATE -fsanitize=thread -g)
target_link_options(episode_pool_race_test PRIVATE -fsanitize=thread)
target_link_libraries(episode_pool_race_test PRIVATE box2d_pinned_race walker_sim_core_objects_race
  walker_sim_wire walker_sim_mujoco walker_sim_flags GTest::GTest Threads::Threads ${CMAKE_DL_LIBS})
walker_sim_register_gtest(episode_pool_race_test episode_pool_race_test long)
