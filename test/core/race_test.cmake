# core_pool_race_test: the pool's threads under ThreadSanitizer, which sees what was compiled for it.
# So the core and Box2D are compiled anew, from the same sources with the same options; MuJoCo's
# library stays as it is.
function(walker_sim_add_race_copy target)
  add_library(${target}_race OBJECT $<TARGET_PROPERTY:${target},SOURCES>)
  # SYSTEM silences warnings in the engines' headers; the original says what is to be said of ours.
  target_include_directories(${target}_race
    SYSTEM PRIVATE $<TARGET_PROPERTY:${target},INCLUDE_DIRECTORIES>)
  target_compile_definitions(${target}_race
    PRIVATE $<TARGET_PROPERTY:${target},COMPILE_DEFINITIONS>)
  target_compile_options(${target}_race
    PRIVATE $<TARGET_PROPERTY:${target},COMPILE_OPTIONS> -fsanitize=thread -g)
endfunction()

walker_sim_add_race_copy(box2d_pinned)
walker_sim_add_race_copy(walker_sim_core_objects)

function(walker_sim_add_race_test name)
  if(CATKIN_ENABLE_TESTING)
    catkin_add_gtest(${name} ${ARGN})
    target_link_libraries(${name} ${GTEST_MAIN_LIBRARIES})
  else()
    add_executable(${name} ${ARGN})
    target_link_libraries(${name} GTest::GTest GTest::Main)
    add_test(NAME ${name} COMMAND ${name} --gtest_output=xml:${test_results}/${name}.xml)
  endif()
  target_include_directories(${name} PRIVATE include src test)
  target_compile_options(${name} PRIVATE -fsanitize=thread -g)
  target_link_options(${name} PRIVATE -fsanitize=thread)
  target_link_libraries(${name} box2d_pinned_race walker_sim_core_objects_race
    walker_sim_mujoco walker_sim_flags Threads::Threads ${CMAKE_DL_LIBS})
endfunction()

walker_sim_add_race_test(core_pool_race_test
  test/core/crew_test.cpp test/core/pool_race_test.cpp)
