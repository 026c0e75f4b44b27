# Everything of ours, Box2D included, compiled so that it tells of its faults while it runs. What the
# libraries of ROS and MuJoCo do is seen at their borders alone.
#   coverage  gcov's counters in what is below include/ and src/, without optimisation, so that lines stay
#             apart; Box2D's own sources have none
#   thread    ThreadSanitizer
#   address   AddressSanitizer and UndefinedBehaviorSanitizer, each of which ends the program
#   fuzzer    the same by clang, with libFuzzer's eyes
if(WALKER_SIM_INSTRUMENT STREQUAL "coverage")
  set(CMAKE_CXX_FLAGS_RELEASE "-O0 -DNDEBUG")
  # Threads count on the same counters.
  string(REGEX REPLACE "([][.+*?^$(){}|])" "\\\\\\1" source_folder "${CMAKE_CURRENT_SOURCE_DIR}")
  add_compile_options(--coverage -fprofile-update=atomic "-fprofile-filter-files=^${source_folder}/(include|src)/")
  add_link_options(--coverage)
  return()
endif()
set(WALKER_SIM_PYTHON OFF) # Python itself knows of no sanitizer
set(CMAKE_CXX_FLAGS_RELEASE "-O1 -DNDEBUG")
if(WALKER_SIM_INSTRUMENT STREQUAL "thread")
  set(instrument_options -fsanitize=thread)
elseif(WALKER_SIM_INSTRUMENT STREQUAL "address")
  set(instrument_options -fsanitize=address,undefined -fno-sanitize-recover=all)
elseif(WALKER_SIM_INSTRUMENT STREQUAL "fuzzer")
  if(NOT CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
    message(FATAL_ERROR "WALKER_SIM_INSTRUMENT = fuzzer: needs clang; CMAKE_CXX_COMPILER is "
      "${CMAKE_CXX_COMPILER_ID}")
  endif()
  set(instrument_options -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=all)
else()
  message(FATAL_ERROR "WALKER_SIM_INSTRUMENT = ${WALKER_SIM_INSTRUMENT}: must be address, coverage, fuzzer, "
    "thread or empty")
endif()
if(NOT WALKER_SIM_INSTRUMENT STREQUAL "thread")
  # The streams of roscpp's headers step on before they look whether they may.
  list(APPEND instrument_options -fno-sanitize=pointer-overflow)
endif()
add_link_options(${instrument_options})
# A call stack has a line for each of our functions; a container that is left is told at once.
add_compile_options(${instrument_options} -g1 -fno-omit-frame-pointer -D_GLIBCXX_ASSERTIONS)
