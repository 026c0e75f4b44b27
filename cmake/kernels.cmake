# The robots' kernels: one source, compiled for several instruction sets. A program selects the
# fastest at its start (docs/box2d_speed.md, docs/walker2d_speed.md).

# Walker2d's kernel has the model's constants compiled in; this program reads them from MuJoCo.
set(walker2d_constants ${CMAKE_CURRENT_BINARY_DIR}/robots/walker2d/model_constants.h)
get_filename_component(mujoco_library_dir ${mujoco_library} DIRECTORY)
add_executable(walker2d_generate_constants src/robots/walker2d/kernel/generate_constants.cpp)
target_include_directories(walker2d_generate_constants PRIVATE src)
target_link_libraries(walker2d_generate_constants PRIVATE walker_sim_mujoco walker_sim_flags)
set_target_properties(walker2d_generate_constants PROPERTIES
  INSTALL_RPATH ${mujoco_library_dir} RUNTIME_OUTPUT_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR})
file(MAKE_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/robots/walker2d) # Make does not create it
add_custom_command(OUTPUT ${walker2d_constants}
  COMMAND walker2d_generate_constants ${CMAKE_CURRENT_SOURCE_DIR}/assets/walker2d_v5.xml ${walker2d_constants}
  DEPENDS walker2d_generate_constants assets/walker2d_v5.xml VERBATIM)

# Options of each robot's kernels for all instruction sets.
set(walker2d_kernel_options -O3 -fno-signed-zeros -ffinite-math-only -fno-trapping-math -fno-math-errno)
set(bipedal_walker_kernel_options -O3 -fno-trapping-math -fno-math-errno)
if(WALKER_SIM_INSTRUMENT STREQUAL "fuzzer") # slow to compile, and not fuzzed
  list(APPEND walker2d_kernel_options -O1 -fno-sanitize=all)
  list(APPEND bipedal_walker_kernel_options -O1 -fno-sanitize=all)
elseif(WALKER_SIM_INSTRUMENT STREQUAL "coverage")
  list(APPEND walker2d_kernel_options -Og)
  list(APPEND bipedal_walker_kernel_options -Og)
endif()

# Each architecture has a baseline, which every processor supports, and wider instruction sets.
set(sse2_options "")
set(neon_options "")
set(avx2_options -mavx2)
set(avx512_options -mavx512f -mavx512dq -mavx512vl -mprefer-vector-width=512)

# walker_sim_add_kernels(ROBOT SET...): sets ROBOT_kernels to the sources of its kernels.
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
  walker_sim_add_kernels(bipedal_walker sse2 avx2 avx512)
elseif(CMAKE_SYSTEM_PROCESSOR STREQUAL "aarch64")
  walker_sim_add_kernels(bipedal_walker neon)
endif()
