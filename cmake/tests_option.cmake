# WALKER_SIM_TESTS: on where the packages that tests need are there.
# Tests need packages that the product does not: where they are missing there are no tests, unless
# somebody asks for them by name.
set(has_tests ON)
find_package(GTest QUIET)
if(NOT GTEST_FOUND)
  set(has_tests OFF)
endif()
if(WALKER_SIM_ROS)
  if(CATKIN_ENABLE_TESTING)
    find_package(rostest QUIET)
    find_package(urdf QUIET)
  endif()
  if(NOT rostest_FOUND OR NOT urdf_FOUND)
    set(has_tests OFF)
  endif()
endif()
option(WALKER_SIM_TESTS "Tests and benchmarks: the targets `tests` and `benchmarks`" ${has_tests})
if(WALKER_SIM_TESTS AND NOT has_tests)
  message(FATAL_ERROR "WALKER_SIM_TESTS = ON: needs GoogleTest, and in a catkin workspace rostest, urdf "
    "and CATKIN_ENABLE_TESTING")
endif()

