# The robots' kernels: one source, compiled for several instruction sets. A program selects the
# fastest at its start (docs/box2d_speed.md, docs/mujoco_speed.md).

# The kernels of robots on MuJoCo have their model's constants compiled in; this program reads them from MuJoCo.
get_filename_component(mujoco_library_dir ${mujoco_library} DIRECTORY)
add_executable(walker_sim_generate_constants src/robots/mujoco/kernel/generate_constants.cpp)
target_include_directories(walker_sim_generate_constants PRIVATE src)
target_link_libraries(walker_sim_generate_constants PRIVATE walker_sim_mujoco walker_sim_flags)
set_target_properties(walker_sim_generate_constants PROPERTIES
  INSTALL_RPATH ${mujoco_library_dir} RUNTIME_OUTPUT_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR})
set(model_constants "")
foreach(robot hopper walker2d)
  set(model ${CMAKE_CURRENT_SOURCE_DIR}/assets/${robot}_v5.xml)
  set(header ${CMAKE_CURRENT_BINARY_DIR}/robots/${robot}/model_constants.h)
  file(MAKE_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/robots/${robot}) # Make does not create it
  add_custom_command(OUTPUT ${header}
    COMMAND walker_sim_generate_constants ${model} ${robot} ${header}
    DEPENDS walker_sim_generate_constants ${model} VERBATIM)
  list(APPEND model_constants ${header})
endforeach()

# Options of the kernels on each engine for all instruction sets.
set(mujoco_kernel_options -O3 -fno-signed-zeros -ffinite-math-only -fno-trapping-math -fno-math-errno)
set(box2d_kernel_options -O3 -fno-trapping-math -fno-math-errno)
if(WALKER_SIM_INSTRUMENT STREQUAL "fuzzer") # slow to compile, and not fuzzed
  list(APPEND mujoco_kernel_options -O1 -fno-sanitize=all)
  list(APPEND box2d_kernel_options -O1 -fno-sanitize=all)
elseif(WALKER_SIM_INSTRUMENT STREQUAL "coverage")
  list(APPEND mujoco_kernel_options -Og)
  list(APPEND box2d_kernel_options -Og)
endif()

# Each architecture has a baseline, which every processor supports, and wider instruction sets.
set(sse2_options "")
set(neon_options "")
set(avx2_options -mavx2)
set(sse2_lanes 2)
set(avx2_lanes 4)
set(avx512_options -mavx512f -mavx512dq -mavx512vl -mprefer-vector-width=512)

# walker_sim_add_kernels(ROBOT ENGINE SET...): sets ROBOT_kernels to the sources of its kernels. Those of robots on
# MuJoCo are made from one template; mujoco_kernel_lists gets the sources that list them.
function(walker_sim_add_kernels robot engine)
  set(folder src/robots/${robot}/kernel)
  if(engine STREQUAL "mujoco")
    set(folder ${CMAKE_CURRENT_BINARY_DIR}/robots/${robot}/kernel)
  endif()
  set(sources "")
  set(declarations "")
  set(pointers "")
  foreach(set ${ARGN})
    set(source ${folder}/kernel_${set}.cpp)
    if(engine STREQUAL "mujoco")
      set(lanes ${${set}_lanes})
      configure_file(src/robots/mujoco/kernel/kernel_set.cpp.in ${source} @ONLY)
      string(APPEND declarations "extern const mujoco::kernel::Kernel kernel_${set};\n")
      string(APPEND pointers "&kernel_${set}, ")
    endif()
    list(APPEND sources ${source})
    set_source_files_properties(${source} PROPERTIES SKIP_PRECOMPILE_HEADERS ON
      COMPILE_OPTIONS "${${engine}_kernel_options};${${set}_options}")
  endforeach()
  set(${robot}_kernels ${sources} PARENT_SCOPE)
  if(engine STREQUAL "mujoco")
    configure_file(src/robots/mujoco/kernel/kernels.cpp.in ${folder}/kernels.cpp @ONLY)
    set(mujoco_kernel_lists ${mujoco_kernel_lists} ${folder}/kernels.cpp PARENT_SCOPE)
  else()
    set_source_files_properties(${folder}/kernel.cpp PROPERTIES COMPILE_DEFINITIONS WALKER_SIM_HAS_KERNELS)
  endif()
endfunction()

set(mujoco_sets "")
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$")
  set(mujoco_sets sse2 avx2)
  walker_sim_add_kernels(bipedal_walker box2d sse2 avx2 avx512)
elseif(CMAKE_SYSTEM_PROCESSOR STREQUAL "aarch64")
  walker_sim_add_kernels(bipedal_walker box2d neon)
endif()
set(mujoco_kernel_lists "")
foreach(robot hopper walker2d)
  walker_sim_add_kernels(${robot} mujoco ${mujoco_sets})
endforeach()
