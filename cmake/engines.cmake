# The engines as targets: walker_sim_box2d and walker_sim_mujoco. Sets mujoco_library and
# mujoco_licences.

# Fetches the pinned ENGINE, unless it is in the cache, and sets OUT to its folder.
function(walker_sim_fetch_engine engine out)
  execute_process(COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/scripts/fetch_engines ${engine}
    OUTPUT_VARIABLE fetched RESULT_VARIABLE result OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "The pinned ${engine} could not be fetched; see above.")
  endif()
  set(${out} ${fetched} PARENT_SCOPE)
endfunction()

set(box2d_source ${BOX2D_SOURCE_DIR})
if(NOT box2d_source)
  walker_sim_fetch_engine(box2d box2d_source)
endif()
if(NOT EXISTS "${box2d_source}/Box2D/Box2D.h")
  message(FATAL_ERROR "BOX2D_SOURCE_DIR = ${box2d_source}: must hold Box2D/Box2D.h of box2d-py 2.3.8")
endif()
# Our replacements of its files use its local variables and private members, so another version
# may compile but give other bits.
set(expected 5d76681c6b77404c086840ca0197fab6eb1dbfecf4bd12acd2acc78efebe6cff)
file(GLOB_RECURSE files RELATIVE ${box2d_source} ${box2d_source}/Box2D/*.cpp ${box2d_source}/Box2D/*.h)
list(SORT files)
set(hashes "")
foreach(file ${files})
  file(SHA256 ${box2d_source}/${file} hash)
  string(APPEND hashes "${hash} ${file}\n")
endforeach()
string(SHA256 found "${hashes}")
if(NOT found STREQUAL expected)
  message(FATAL_ERROR "BOX2D_SOURCE_DIR = ${box2d_source}: must hold the C++ sources of box2d-py 2.3.8 "
    "as they are. Their hashes together hash to ${found}; must be ${expected}. An empty "
    "BOX2D_SOURCE_DIR fetches them")
endif()
set(box2d_ours ${CMAKE_CURRENT_SOURCE_DIR}/src/robots/bipedal_walker/box2d_pinned)
file(GLOB_RECURSE box2d_sources CONFIGURE_DEPENDS ${box2d_source}/Box2D/*.cpp)
list(FILTER box2d_sources EXCLUDE REGEX "/Common/b2BlockAllocator.cpp$")
list(APPEND box2d_sources ${box2d_ours}/b2BlockAllocator.cpp)

# walker_sim_patch_box2d(FILE REGEX REPLACEMENT): replaces text in a copy of Box2D's FILE, which is
# compiled in the file's place.
function(walker_sim_patch_box2d file regex replacement)
  set(original ${box2d_source}/Box2D/${file})
  set(copy ${CMAKE_CURRENT_BINARY_DIR}/box2d/${file})
  file(READ ${original} text)
  string(REGEX REPLACE "${regex}" "${replacement}" patched "${text}")
  if(patched STREQUAL text)
    message(FATAL_ERROR "${original}: has no text that matches ${regex}")
  endif()
  file(WRITE ${copy}.new "// Altered by cmake/engines.cmake of walker_sim.\n\n${patched}")
  configure_file(${copy}.new ${copy} COPYONLY) # changes no time stamp if the text is the same
  list(FILTER box2d_sources EXCLUDE REGEX "/${file}$")
  set(box2d_sources ${box2d_sources} ${copy} PARENT_SCOPE)
endfunction()
# Without the process-wide counters, which all threads would write and nothing reads.
set(counter_line "[^\n]*b2_(gjk|toi)(Max)?(Root)?(Calls|Iters|Time)[^\n]*\n")
walker_sim_patch_box2d(Collision/b2Distance.cpp "${counter_line}" "")
walker_sim_patch_box2d(Collision/b2TimeOfImpact.cpp "${counter_line}" "")
# Without reading the clock a dozen times per step, often a system call, for unused profile data.
walker_sim_patch_box2d(Common/b2Timer.cpp "gettimeofday\\(&t, 0\\)" "t = timeval()")

add_library(box2d_pinned STATIC ${box2d_sources})
set_target_properties(box2d_pinned PROPERTIES UNITY_BUILD ON)
set_source_files_properties(${box2d_ours}/world_shortcuts.cpp ${box2d_ours}/world_state.cpp
  ${box2d_ours}/world_step.cpp PROPERTIES COMPILE_OPTIONS -fno-access-control)
if(WALKER_SIM_INSTRUMENT STREQUAL "coverage") # our files only, for exact line numbers
  set_property(SOURCE ${box2d_ours}/b2BlockAllocator.cpp APPEND PROPERTY COMPILE_OPTIONS -O0)
endif()
# The optimisation level and FP contraction determine the bits. Symbols are hidden because
# Gymnasium's Box2D may be loaded in the same process.
set(box2d_options -O3 -ffp-contract=off -w)
if(WALKER_SIM_INSTRUMENT STREQUAL "address")
  list(APPEND box2d_options -fno-sanitize=vptr) # Box2D reads a joint's type after its destructor
endif()
target_include_directories(box2d_pinned
  SYSTEM PUBLIC ${box2d_source} ${CMAKE_CURRENT_SOURCE_DIR}/src/robots/bipedal_walker/box2d_without_python
  PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/src)
target_compile_options(box2d_pinned PRIVATE ${box2d_options})
set_target_properties(box2d_pinned PROPERTIES
  CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
add_library(walker_sim_box2d ALIAS box2d_pinned)

set(mujoco_dir ${MUJOCO_DIR})
if(NOT mujoco_dir)
  walker_sim_fetch_engine(mujoco mujoco_dir)
endif()
set(mujoco_include_dir ${mujoco_dir}/include)
set(mujoco_library ${mujoco_dir}/lib/libmujoco.so.2.2.2)
if(NOT EXISTS "${mujoco_include_dir}/mujoco/mujoco.h")
  message(FATAL_ERROR
    "MUJOCO_DIR = ${mujoco_dir}: must hold include/mujoco/mujoco.h and lib/ of MuJoCo 2.2.2")
endif()
file(STRINGS "${mujoco_include_dir}/mujoco/mujoco.h" mujoco_version
  REGEX "^#define mjVERSION_HEADER +[0-9]+")
string(REGEX REPLACE "[^0-9]" "" mujoco_version "${mujoco_version}")
if(NOT mujoco_version STREQUAL "222")
  message(FATAL_ERROR "${mujoco_include_dir}/mujoco/mujoco.h: mjVERSION_HEADER is "
    "\"${mujoco_version}\"; must be 222, MuJoCo 2.2.2, whose results are Gymnasium's to the bit. "
    "-DMUJOCO_DIR=DIR names the folder of an unpacked release; an empty one fetches it")
endif()
if(NOT EXISTS "${mujoco_library}")
  message(FATAL_ERROR "MUJOCO_DIR = ${mujoco_dir}: must hold lib/libmujoco.so.2.2.2")
endif()
# Programs load a copy in the build folder. If they used MUJOCO_DIR and it was removed, the loader
# would silently take the distribution's library of the same name.
if(WALKER_SIM_ROS)
  set(mujoco_copy ${CATKIN_DEVEL_PREFIX}/${CATKIN_PACKAGE_LIB_DESTINATION}/libmujoco.so.2.2.2)
else()
  set(mujoco_copy ${CMAKE_CURRENT_BINARY_DIR}/mujoco/libmujoco.so.2.2.2)
endif()
#catkin_lint: ignore_once external_file
configure_file(${mujoco_library} ${mujoco_copy} COPYONLY)
set(mujoco_library ${mujoco_copy})
file(GLOB mujoco_licences ${mujoco_dir}/*LICENSE* ${mujoco_dir}/THIRD_PARTY*)
add_library(walker_sim_mujoco SHARED IMPORTED)
set_target_properties(walker_sim_mujoco PROPERTIES IMPORTED_LOCATION ${mujoco_library})
#catkin_lint: ignore_once missing_directory external_directory
target_include_directories(walker_sim_mujoco SYSTEM INTERFACE ${mujoco_include_dir})
# LD_LIBRARY_PATH may name the distribution's folder. The loader searches DT_RPATH before it, and
# DT_RUNPATH, the linkers' default, after it.
target_link_options(walker_sim_mujoco INTERFACE "-Wl,--disable-new-dtags")
