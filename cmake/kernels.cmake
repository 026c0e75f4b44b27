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

# Of Walker2d's model, for its kernel (docs/walker2d_speed.md).
set(walker2d_constants ${CMAKE_CURRENT_BINARY_DIR}/robots/walker2d/model_constants.h)
get_filename_component(mujoco_library_dir ${mujoco_library} DIRECTORY)
add_executable(walker2d_generate_constants src/robots/walker2d/kernel/generate_constants.cpp)
target_include_directories(walker2d_generate_constants PRIVATE src)
target_link_libraries(walker2d_generate_constants PRIVATE walker_sim_mujoco walker_sim_flags)
set_target_properties(walker2d_generate_constants PROPERTIES
  INSTALL_RPATH ${mujoco_library_dir} RUNTIME_OUTPUT_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR})
file(MAKE_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/robots/walker2d) # Make, unlike Ninja, leaves an output's folder to us
add_custom_command(OUTPUT ${walker2d_constants}
  COMMAND walker2d_generate_constants ${CMAKE_CURRENT_SOURCE_DIR}/assets/walker2d_v5.xml ${walker2d_constants}
  DEPENDS walker2d_generate_constants assets/walker2d_v5.xml VERBATIM)

# The kernels, one source for all sets of instructions: what any processor of the kind can run, and
# those that are chosen where it can. BipedalWalker's have the bits of the pinned Box2D alone.
set(walker2d_kernel_options -O3 -fno-signed-zeros -ffinite-math-only -fno-trapping-math -fno-math-errno)
set(bipedal_walker_kernel_options -O3 -fno-trapping-math -fno-math-errno)
if(WALKER_SIM_INSTRUMENT STREQUAL "fuzzer") # clang takes minutes for each, and no byte from outside gets there
  list(APPEND walker2d_kernel_options -O1 -fno-sanitize=all)
  list(APPEND bipedal_walker_kernel_options -O1 -fno-sanitize=all)
elseif(WALKER_SIM_INSTRUMENT STREQUAL "coverage")
  list(APPEND walker2d_kernel_options -Og)
  list(APPEND bipedal_walker_kernel_options -Og)
endif()
set(sse2_options "")
set(neon_options "")
set(avx2_options -mavx2)
set(avx512_options -mavx512f -mavx512dq -mavx512vl -mprefer-vector-width=512)
# walker_sim_add_kernels(ROBOT SET...): sets ROBOT_kernels.
function(walker_sim_add_kernels robot)
  set(sources "")
  foreach(set ${ARGN})
    set(source src/robots/${robot}/kernel/kernel_${set}.cpp)
    list(APPEND sources ${source})
    set_source_files_properties(${source} PROPERTIES SKIP_PRECOMPILE_HEADERS ON
      COMPILE_OPTIONS "${${robot}_kernel_options};${${set}_options}")
  endforeach()
  set_source_files_properties(src/robots/${robot}/kernel/kernel.cpp
    PROPERTIES COMPILE_DEFINITIONS WALKER_SIM_HAS_KERNELS)
  set(${robot}_kernels ${sources} PARENT_SCOPE)
endfunction()
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$")
  walker_sim_add_kernels(walker2d sse2 avx2)
  if(WALKER_SIM_ENGINES STREQUAL "pinned")
    walker_sim_add_kernels(bipedal_walker sse2 avx2 avx512)
  endif()
elseif(CMAKE_SYSTEM_PROCESSOR STREQUAL "aarch64" AND WALKER_SIM_ENGINES STREQUAL "pinned")
  walker_sim_add_kernels(bipedal_walker neon)
endif()
