walker_sim_sources(core_sources
  compile_apart locomotion_robot model offscreen_context physics planar_model planar_robot renderer
  specification)

# The models of assets/ become part of the library.
file(GLOB model_files CONFIGURE_DEPENDS assets/*.xml)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${model_files})
set(builtin_models "")
foreach(file ${model_files})
  get_filename_component(name ${file} NAME)
  file(READ ${file} text)
  string(APPEND builtin_models "{\"${name}\", R\"mjcf(${text})mjcf\"},\n")
endforeach()
configure_file(${CMAKE_CURRENT_LIST_DIR}/builtin_models.cpp.in builtin_models.cpp @ONLY)
list(APPEND core_sources ${CMAKE_CURRENT_BINARY_DIR}/builtin_models.cpp)
