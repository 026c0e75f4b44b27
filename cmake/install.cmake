# Installation of the catkin package and of the wheel.
if(WALKER_SIM_ROS)
  install(TARGETS walker_sim_core
    ARCHIVE DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION}
    LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION}
    RUNTIME DESTINATION ${CATKIN_GLOBAL_BIN_DESTINATION})
  install(TARGETS walker_sim_compile_model ${node_targets}
    RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
  if(TARGET walker_sim_rviz_plugins)
    install(TARGETS walker_sim_rviz_plugins
      ARCHIVE DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION}
      LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION}
      RUNTIME DESTINATION ${CATKIN_GLOBAL_BIN_DESTINATION})
  endif()
  if(WALKER_SIM_PYTHON)
    install(TARGETS walker_sim_python
      ARCHIVE DESTINATION ${CATKIN_PACKAGE_PYTHON_DESTINATION}
      LIBRARY DESTINATION ${CATKIN_PACKAGE_PYTHON_DESTINATION}
      RUNTIME DESTINATION ${CATKIN_GLOBAL_BIN_DESTINATION})
  endif()
  catkin_install_python(PROGRAMS src/nodes/doctor src/nodes/page src/nodes/view.py
    DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
  install(DIRECTORY include/${PROJECT_NAME}/ DESTINATION ${CATKIN_PACKAGE_INCLUDE_DESTINATION})
  install(DIRECTORY assets config launch urdf DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
  install(FILES LICENSE NOTICE rviz_plugins.xml DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
  # Debian 12 has a libmujoco.so.2.2.2 of its own, on the path of a Debian package of this one.
  install(FILES ${mujoco_library} DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION}/${PROJECT_NAME})
  install(FILES ${mujoco_licences}
    DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION}/licenses/mujoco)
elseif(SKBUILD)
  install(TARGETS walker_sim_compile_model walker_sim_python
    LIBRARY DESTINATION walker_sim RUNTIME DESTINATION walker_sim)
  # walker_sim/files.py expects them there.
  install(DIRECTORY assets/policies DESTINATION walker_sim/share/assets)
  install(DIRECTORY config/training DESTINATION walker_sim/share/config)
  install(FILES ${mujoco_library} DESTINATION walker_sim)
  install(FILES ${mujoco_licences} DESTINATION ${SKBUILD_METADATA_DIR}/licenses/mujoco)
endif()
