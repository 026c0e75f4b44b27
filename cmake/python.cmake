# The extension module walker_sim._core.
# A dependency of image_transport may have found a Python without its headers.
unset(Python_FOUND)
unset(Python3_FOUND)
find_package(pybind11 REQUIRED)
walker_sim_sources(python_sources python)
add_library(walker_sim_python MODULE ${python_sources})
pybind11_extension(walker_sim_python)
set_target_properties(walker_sim_python PROPERTIES OUTPUT_NAME _core CXX_VISIBILITY_PRESET hidden
  VISIBILITY_INLINES_HIDDEN ON)
target_link_libraries(walker_sim_python PRIVATE pybind11::module walker_sim_core_objects walker_sim_drawing
  Threads::Threads ${CMAKE_DL_LIBS} "-Wl,--exclude-libs,ALL")
# With ROS, the module goes beside the messages in the devel space. Without ROS, walker_sim's
# extend_path finds it if this build's python/ is on Python's path.
if(WALKER_SIM_ROS)
  set(python_package ${CATKIN_DEVEL_PREFIX}/${CATKIN_PACKAGE_PYTHON_DESTINATION})
  file(RELATIVE_PATH libraries_path
    /${CATKIN_PACKAGE_PYTHON_DESTINATION} /${CATKIN_PACKAGE_LIB_DESTINATION})
  set(python_rpath "$ORIGIN/${libraries_path}/${PROJECT_NAME};$ORIGIN/${libraries_path}")
else()
  set(python_package ${CMAKE_CURRENT_BINARY_DIR}/python/walker_sim)
  file(WRITE ${python_package}/__init__.py "")
  set(python_rpath "$ORIGIN")
endif()
set_target_properties(walker_sim_python PROPERTIES
  LIBRARY_OUTPUT_DIRECTORY ${python_package} INSTALL_RPATH "${python_rpath}")
