# One program for each shortcut of src/robots/bipedal_walker/box2d_pinned by itself, one for all and one
# for none. They play the same episodes; shortcuts_test compares what they write.

# The core without the files of which there are two.
set(shared_objects
  "$<FILTER:$<TARGET_OBJECTS:walker_sim_core_objects>,EXCLUDE,/box2d_pinned/>")

# An executable walker_sim_shortcut_NAME with the named files of box2d_pinned/.
function(walker_sim_add_shortcut name)
  set(sources ${shared_objects} test/robots/bipedal_walker/shortcut_player.cpp)
  foreach(file ${ARGN})
    list(APPEND sources src/robots/bipedal_walker/box2d_pinned/${file}.cpp)
  endforeach()
  foreach(file body_list broad_phase cast_rays together world_state)
    if(NOT file IN_LIST ARGN)
      list(APPEND sources src/robots/bipedal_walker/box2d_any/${file}.cpp)
    endif()
  endforeach()
  add_executable(walker_sim_shortcut_${name} EXCLUDE_FROM_ALL ${sources})
  target_include_directories(walker_sim_shortcut_${name} PRIVATE include src test)
  target_compile_options(walker_sim_shortcut_${name} PRIVATE ${box2d_options})
  target_compile_definitions(walker_sim_shortcut_${name} PRIVATE
    WALKER_SIM_RECORDINGS="${CMAKE_CURRENT_SOURCE_DIR}/test/recordings")
  # Object files come before the library's members of the same content.
  target_link_libraries(walker_sim_shortcut_${name}
    PRIVATE walker_sim_wire box2d_plain walker_sim_mujoco Threads::Threads ${CMAKE_DL_LIBS})
  target_compile_definitions(robots_bipedal_walker_shortcuts_test PRIVATE
    "WALKER_SIM_SHORTCUT_${name}=\"$<TARGET_FILE:walker_sim_shortcut_${name}>\"")
  add_dependencies(robots_bipedal_walker_shortcuts_test walker_sim_shortcut_${name})
endfunction()

add_executable(robots_bipedal_walker_shortcuts_test EXCLUDE_FROM_ALL
  test/unit_test_main.cpp test/robots/bipedal_walker/shortcuts_test.cpp)
target_include_directories(robots_bipedal_walker_shortcuts_test PRIVATE test)
target_link_libraries(robots_bipedal_walker_shortcuts_test PRIVATE walker_sim_core_objects walker_sim_flags
  GTest::GTest Threads::Threads ${CMAKE_DL_LIBS})
walker_sim_register_gtest(robots_bipedal_walker_shortcuts_test robots_bipedal_walker_shortcuts_test long)
walker_sim_add_shortcut(none)
walker_sim_add_shortcut(blocks b2BlockAllocator)
walker_sim_add_shortcut(broad_phase broad_phase)
walker_sim_add_shortcut(clock b2Timer)
walker_sim_add_shortcut(counters counters)
walker_sim_add_shortcut(velocity_loops b2Island)
walker_sim_add_shortcut(body_list body_list)
walker_sim_add_shortcut(rays cast_rays)
walker_sim_add_shortcut(all ${box2d_replacements} body_list broad_phase cast_rays)
