# Headers of ROS, pybind11 and the standard library take longer to compile than the files that
# include them. All files also compile with -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON.
if(WALKER_SIM_ROS)
  # The agents match topics by stamp with templates that compile twice as fast at -O1; no step waits
  # for them. GCC reuses a precompiled header only at the same optimisation level.
  target_compile_options(walker_sim_agents PRIVATE -O1)
  foreach(library walker_sim_agents walker_sim_server)
    target_precompile_headers(${library} PRIVATE
      <algorithm> <chrono> <functional> <map> <memory> <optional> <sstream> <stdexcept> <string>
      <thread> <vector> <ros/ros.h> <diagnostic_updater/diagnostic_updater.h> <nav_msgs/Odometry.h>
      <sensor_msgs/Image.h> <sensor_msgs/Imu.h> <sensor_msgs/JointState.h> <sensor_msgs/LaserScan.h>
      <std_msgs/Float64MultiArray.h> <tf2_msgs/TFMessage.h> <visualization_msgs/MarkerArray.h>)
  endforeach()
  # walker_sim_compile_as(LIBRARY TARGET...): compiles TARGETs like LIBRARY and reuses its
  # precompiled headers.
  function(walker_sim_compile_as library)
    foreach(target ${ARGN})
      set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE OFF)
      target_compile_options(${target} PRIVATE -fPIC)
      target_precompile_headers(${target} REUSE_FROM ${library})
    endforeach()
  endfunction()
  walker_sim_compile_as(walker_sim_server walker_sim_replay ${node_targets})
endif()
if(WALKER_SIM_PYTHON)
  target_precompile_headers(walker_sim_python PRIVATE <pybind11/pybind11.h> <pybind11/stl.h>)
endif()
target_precompile_headers(walker_sim_core_objects PRIVATE
  <algorithm> <array> <cmath> <cstdint> <limits> <map> <memory> <optional> <stdexcept> <string>
  <vector>)
