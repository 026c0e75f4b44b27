# WALKER_SIM_INSTRUMENT compiles this package and Box2D with a sanitizer or with gcov's counters. ROS's
# libraries and MuJoCo are not instrumented.
#   coverage  gcov's counters in include/ and src/, not in Box2D's sources; without optimisation, so that
#             the compiler does not merge lines
#   thread    ThreadSanitizer
#   address   AddressSanitizer and UndefinedBehaviorSanitizer; any error aborts the program
#   fuzzer    as address, with libFuzzer's coverage counters; needs clang
if(WALKER_SIM_INSTRUMENT STREQUAL "coverage")
  set(CMAKE_CXX_FLAGS_RELEASE "-O0 -DNDEBUG")
  # Threads share the counters, so they are updated atomically.
  string(REGEX REPLACE "([][.+*?^$(){}|])" "\\\\\\1" source_folder "${CMAKE_CURRENT_SOURCE_DIR}")
  add_compile_options(--coverage -fprofile-update=atomic "-fprofile-filter-files=^${source_folder}/(include|src)/")
  add_link_options(--coverage)
  return()
endif()
set(WALKER_SIM_PYTHON OFF) # the Python interpreter is not instrumented
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
  # The streams in roscpp's headers advance a pointer before they check its bounds.
  list(APPEND instrument_options -fno-sanitize=pointer-overflow)
endif()
add_link_options(${instrument_options})
# Stack traces show line numbers and every function; out-of-range container accesses abort the program.
add_compile_options(${instrument_options} -g1 -fno-omit-frame-pointer -D_GLIBCXX_ASSERTIONS)
