# core_sources: the core's source files, those of the rooms that need neither ROS nor Python.

# walker_sim_sources(LIST ROOM...): sets LIST to all source files below src/ROOM...
function(walker_sim_sources list)
  list(TRANSFORM ARGN REPLACE "(.+)" "src/\\1/*.cpp" OUTPUT_VARIABLE patterns)
  file(GLOB_RECURSE files CONFIGURE_DEPENDS ${patterns})
  set(${list} ${files} PARENT_SCOPE)
endfunction()

walker_sim_sources(core_sources base simd robots episode policy client)
list(REMOVE_ITEM core_sources ${box2d_sources})
list(FILTER core_sources EXCLUDE REGEX
  "/(compile_model|kernel/(generate_constants|kernel_(sse2|avx2|avx512|neon)))[.]cpp$")
list(APPEND core_sources ${model_constants} ${mujoco_kernel_lists} ${hopper_kernels} ${walker2d_kernels}
  ${bipedal_walker_kernels})

# Only registry.cpp gets the version: one compiler cache serves the other files of every build.
set_source_files_properties(src/robots/registry.cpp PROPERTIES
  COMPILE_DEFINITIONS "WALKER_SIM_VERSION=\"${PROJECT_VERSION}\"")
# -fno-trapping-math lets the compiler vectorise tanh.
set_source_files_properties(src/policy/network.cpp PROPERTIES
  SKIP_PRECOMPILE_HEADERS ON COMPILE_OPTIONS -fno-trapping-math)

# The models of assets and the worlds of config/worlds become part of the library.
function(walker_sim_embed list source pattern component)
  file(GLOB files CONFIGURE_DEPENDS ${pattern})
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${files})
  set(${list} "")
  foreach(file ${files})
    get_filename_component(name ${file} ${component})
    file(READ ${file} text)
    string(APPEND ${list} "{\"${name}\", R\"text(${text})text\"},\n")
  endforeach()
  configure_file(${source}.in ${list}.cpp @ONLY)
  set(core_sources ${core_sources} ${CMAKE_CURRENT_BINARY_DIR}/${list}.cpp PARENT_SCOPE)
endfunction()
walker_sim_embed(builtin_models src/robots/mujoco/builtin_models.cpp assets/*.xml NAME)
walker_sim_embed(builtin_worlds src/episode/builtin_worlds.cpp config/worlds/*.yaml NAME_WE)
