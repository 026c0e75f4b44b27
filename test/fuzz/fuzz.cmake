# Fuzz targets, NAME_fuzz.cpp. In the ordinary tests, one program per room runs its targets on their
# corpora. With WALKER_SIM_INSTRUMENT=fuzzer, each target is also a libFuzzer program, NAME_fuzz.
# Included by tests.cmake.
add_custom_target(fuzz_programs)

# walker_sim_add_fuzz_targets(ROOM LIBRARIES LIBRARY... TARGETS NAME... [ALSO SOURCE...])
function(walker_sim_add_fuzz_targets room)
  cmake_parse_arguments(add "" "" "LIBRARIES;TARGETS;ALSO" ${ARGN})
  list(TRANSFORM add_TARGETS REPLACE "(.+)" "test/fuzz/\\1_fuzz.cpp" OUTPUT_VARIABLE files)
  set(programs ${room}_fuzz_tests)
  add_executable(${room}_fuzz_tests EXCLUDE_FROM_ALL
    test/unit_test_main.cpp test/fuzz/corpus_test.cpp ${files} ${add_ALSO})
  target_compile_definitions(${room}_fuzz_tests PRIVATE
    WALKER_SIM_SOURCE_DIR="${CMAKE_CURRENT_SOURCE_DIR}")
  target_link_libraries(${room}_fuzz_tests PRIVATE GTest::GTest)
  if(WALKER_SIM_INSTRUMENT STREQUAL "fuzzer")
    foreach(name ${add_TARGETS})
      add_executable(${name}_fuzz EXCLUDE_FROM_ALL
        test/fuzz/${name}_fuzz.cpp test/fuzz/libfuzzer.cpp ${add_ALSO})
      target_link_options(${name}_fuzz PRIVATE -fsanitize=fuzzer)
      add_dependencies(fuzz_programs ${name}_fuzz)
      list(APPEND programs ${name}_fuzz)
    endforeach()
  endif()
  foreach(program ${programs})
    target_include_directories(${program} PRIVATE include src test)
    target_link_libraries(${program} PRIVATE ${add_LIBRARIES} walker_sim_flags Threads::Threads ${CMAKE_DL_LIBS})
    if(walker_sim_server IN_LIST add_LIBRARIES)
      walker_sim_compile_as(walker_sim_server ${program})
    else()
      target_compile_options(${program} PRIVATE ${test_options})
    endif()
  endforeach()
  foreach(name ${add_TARGETS})
    walker_sim_register_gtest(fuzz_${name} ${room}_fuzz_tests short --gtest_filter=Fuzz/CorpusTest.*/${name})
  endforeach()
endfunction()

walker_sim_add_fuzz_targets(core LIBRARIES ${core_libraries}
  TARGETS model parameter_text policy saved_state)
# The same code with a scripted socket.
walker_sim_add_fuzz_targets(client LIBRARIES walker_sim_wire walker_sim_box2d walker_sim_mujoco
  TARGETS client http
  ALSO test/fuzz/scripted_socket.cpp $<TARGET_OBJECTS:walker_sim_core_objects>)
walker_sim_add_fuzz_targets(server LIBRARIES walker_sim_replay walker_sim_server
  TARGETS bag episode_record requests service_session)
