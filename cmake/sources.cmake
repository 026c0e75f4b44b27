# core_sources: the core's source files, those of the rooms that need neither ROS nor Python.

# walker_sim_sources(LIST ROOM...): sets LIST to all source files below src/ROOM...
function(walker_sim_sources list)
  list(TRANSFORM ARGN REPLACE "(.+)" "src/\\1/*.cpp" OUTPUT_VARIABLE patterns)
  file(GLOB_RECURSE files CONFIGURE_DEPENDS ${patterns})
  set(${list} ${files} PARENT_SCOPE)
endfunction()

walker_sim_sources(core_sources base simd robots episode policy client)
list(REMOVE_ITEM core_sources ${box2d_sources})
list(FILTER core_sources EXCLUDE REGEX "/kernel/(generate_constants|kernel_(sse2|avx2|avx512|neon))[.]cpp$")
list(APPEND core_sources ${walker2d_constants} ${walker2d_kernels} ${bipedal_walker_kernels})

# Only registry.cpp gets the version: one compiler cache serves the other files of every build.
set_source_files_properties(src/robots/registry.cpp PROPERTIES
  COMPILE_DEFINITIONS "WALKER_SIM_VERSION=\"${PROJECT_VERSION}\"")
# -fno-trapping-math lets the compiler vectorise tanh.
set_source_files_properties(src/policy/network.cpp PROPERTIES
  SKIP_PRECOMPILE_HEADERS ON COMPILE_OPTIONS -fno-trapping-math)

# The models of assets/ become part of the library.
file(GLOB model_files CONFIGURE_DEPENDS assets/*.xml)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${model_files})
set(builtin_models "")
foreach(file ${model_files})
  get_filename_component(name ${file} NAME)
  file(READ ${file} text)
  string(APPEND builtin_models "{\"${name}\", R\"mjcf(${text})mjcf\"},\n")
endforeach()
configure_file(src/robots/mujoco/builtin_models.cpp.in builtin_models.cpp @ONLY)
list(APPEND core_sources ${CMAKE_CURRENT_BINARY_DIR}/builtin_models.cpp)
