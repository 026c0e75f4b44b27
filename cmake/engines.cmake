# The engines as interface targets: walker_sim_box2d and walker_sim_mujoco. Sets box2d_origin and
# mujoco_origin, which ~get_spec reports, and for the installation mujoco_dir, mujoco_library and
# mujoco_licences; mujoco_dir is empty if the library is the distribution's.

# Sets OUT to the folder in the cache that holds the pinned ENGINE, as scripts/fetch_engines names it.
function(walker_sim_fetch_engine engine out)
  execute_process(COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/scripts/fetch_engines ${engine}
    OUTPUT_VARIABLE fetched RESULT_VARIABLE result OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "The pinned ${engine} could not be fetched; the reason stands above.")
  endif()
  set(${out} ${fetched} PARENT_SCOPE)
endfunction()

# Our replacements of Box2D's files rely on its local variables and private members: another version
# may compile and give other bits.
function(walker_sim_check_box2d folder)
  set(expected 5d76681c6b77404c086840ca0197fab6eb1dbfecf4bd12acd2acc78efebe6cff)
  file(GLOB_RECURSE files RELATIVE ${folder} ${folder}/Box2D/*.cpp ${folder}/Box2D/*.h)
  list(SORT files)
  set(hashes "")
  foreach(file ${files})
    file(SHA256 ${folder}/${file} hash)
    string(APPEND hashes "${hash} ${file}\n")
  endforeach()
  string(SHA256 found "${hashes}")
  if(NOT found STREQUAL expected)
    message(FATAL_ERROR "BOX2D_SOURCE_DIR = ${folder}: must hold the C++ sources of box2d-py 2.3.8 "
      "as they are. Their hashes together hash to ${found}; must be ${expected}. An empty "
      "BOX2D_SOURCE_DIR fetches them; WALKER_SIM_ENGINES=system takes the distribution's Box2D")
  endif()
endfunction()

# ---------------------------------------------------------------- Box2D
# Sets box2d_room_sources to the files of src/robots/bipedal_walker that depend on the Box2D chosen.
add_library(walker_sim_box2d INTERFACE)
set(box2d_room_files body_list broad_phase cast_rays together world_state)
if(WALKER_SIM_ENGINES STREQUAL "pinned")
  set(box2d_source ${BOX2D_SOURCE_DIR})
  if(NOT box2d_source)
    walker_sim_fetch_engine(box2d box2d_source)
  endif()
  if(NOT EXISTS "${box2d_source}/Box2D/Box2D.h")
    message(FATAL_ERROR "BOX2D_SOURCE_DIR = ${box2d_source}: must hold Box2D/Box2D.h of box2d-py 2.3.8")
  endif()
  walker_sim_check_box2d(${box2d_source})
  file(GLOB_RECURSE box2d_sources CONFIGURE_DEPENDS ${box2d_source}/Box2D/*.cpp)
  # Box2D unchanged, against which tests compare ours.
  add_library(box2d_plain STATIC EXCLUDE_FROM_ALL ${box2d_sources})
  # Ours: our files replace those of the same name; counters.cpp replaces two others.
  list(FILTER box2d_sources EXCLUDE
    REGEX "/b2(BlockAllocator|Distance|Island|TimeOfImpact|Timer)\\.cpp$")
  set(box2d_replacements b2BlockAllocator b2Island b2Timer counters)
  set(box2d_ours ${CMAKE_CURRENT_SOURCE_DIR}/src/robots/bipedal_walker/box2d_pinned)
  foreach(name ${box2d_replacements})
    list(APPEND box2d_sources ${box2d_ours}/${name}.cpp)
  endforeach()
  add_library(box2d_pinned STATIC ${box2d_sources})
  set_target_properties(box2d_pinned PROPERTIES UNITY_BUILD ON)
  set_source_files_properties(${box2d_ours}/b2Island.cpp ${box2d_ours}/body_list.cpp
    ${box2d_ours}/broad_phase.cpp ${box2d_ours}/swept_vertices.cpp ${box2d_ours}/world_impacts.cpp
    ${box2d_ours}/world_state.cpp ${box2d_ours}/world_step.cpp PROPERTIES COMPILE_OPTIONS -fno-access-control)
  if(WALKER_SIM_INSTRUMENT STREQUAL "coverage") # only our files, so that their lines stay apart
    foreach(name ${box2d_replacements})
      set_property(SOURCE ${box2d_ours}/${name}.cpp APPEND PROPERTY COMPILE_OPTIONS -O0)
    endforeach()
  endif()
  # Optimisation level and contraction determine the bits. Symbols are hidden, for Gymnasium's own
  # Box2D may be loaded in the same process.
  set(box2d_options -O3 -ffp-contract=off -w)
  if(WALKER_SIM_INSTRUMENT STREQUAL "address")
    list(APPEND box2d_options -fno-sanitize=vptr) # Box2D reads a joint's type after its destructor
  endif()
  foreach(library box2d_plain box2d_pinned)
    target_include_directories(${library}
      SYSTEM PUBLIC ${box2d_source} ${CMAKE_CURRENT_SOURCE_DIR}/src/robots/bipedal_walker/box2d_without_python
      PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/src)
    target_compile_options(${library} PRIVATE ${box2d_options})
    set_target_properties(${library} PROPERTIES
      CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  endforeach()
  set(box2d_room box2d_pinned)
  list(APPEND box2d_room_files swept_vertices world_impacts world_step)
  target_link_libraries(walker_sim_box2d INTERFACE box2d_pinned)
  set(box2d_origin "pinned, box2d-py 2.3.8")
elseif(WALKER_SIM_ENGINES STREQUAL "system")
  find_path(BOX2D_2_4_INCLUDE_DIR box2d/box2d.h)
  find_path(BOX2D_2_3_INCLUDE_DIR Box2D/Box2D.h)
  find_library(BOX2D_LIBRARY NAMES box2d Box2D)
  if(NOT BOX2D_LIBRARY OR NOT (BOX2D_2_4_INCLUDE_DIR OR BOX2D_2_3_INCLUDE_DIR))
    message(FATAL_ERROR "WALKER_SIM_ENGINES = system: no Box2D found; install libbox2d-dev")
  endif()
  if(BOX2D_2_4_INCLUDE_DIR)
    target_include_directories(walker_sim_box2d SYSTEM INTERFACE ${BOX2D_2_4_INCLUDE_DIR})
  else()
    target_include_directories(walker_sim_box2d SYSTEM INTERFACE ${BOX2D_2_3_INCLUDE_DIR})
  endif()
  target_link_libraries(walker_sim_box2d INTERFACE ${BOX2D_LIBRARY})
  set(box2d_room box2d_any)
  set(box2d_origin system)
else()
  message(FATAL_ERROR "WALKER_SIM_ENGINES = ${WALKER_SIM_ENGINES}: must be pinned or system")
endif()

list(TRANSFORM box2d_room_files REPLACE "(.+)" "src/robots/bipedal_walker/${box2d_room}/\\1.cpp"
  OUTPUT_VARIABLE box2d_room_sources)

# ---------------------------------------------------------------- MuJoCo
# An unpacked release (lib/, include/), given or fetched, or the distribution's package.
set(mujoco_dir ${MUJOCO_DIR})
if(WALKER_SIM_ENGINES STREQUAL "pinned")
  set(mujoco_origin "pinned, mujoco 2.2.2")
  if(NOT mujoco_dir)
    walker_sim_fetch_engine(mujoco mujoco_dir)
  endif()
elseif(mujoco_dir)
  set(mujoco_origin "MUJOCO_DIR")
else()
  set(mujoco_origin "system")
endif()
if(mujoco_dir)
  set(mujoco_include_dir ${mujoco_dir}/include)
  set(mujoco_library ${mujoco_dir}/lib/libmujoco.so.2.2.2)
else()
  find_path(MUJOCO_INCLUDE_DIR mujoco/mujoco.h)
  find_library(MUJOCO_LIBRARY mujoco)
  set(mujoco_include_dir ${MUJOCO_INCLUDE_DIR})
  set(mujoco_library ${MUJOCO_LIBRARY})
  if(NOT mujoco_include_dir OR NOT mujoco_library)
    message(FATAL_ERROR "WALKER_SIM_ENGINES = system: no MuJoCo found. Install libmujoco-dev; where "
      "the distribution has none, as Ubuntu 20.04, unpack a release of MuJoCo 2.2.2 and name its "
      "folder: -DMUJOCO_DIR=DIR")
  endif()
endif()
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
    "WALKER_SIM_ENGINES=pinned fetches it; -DMUJOCO_DIR=DIR names the folder of an unpacked release")
endif()
if(NOT EXISTS "${mujoco_library}")
  message(FATAL_ERROR "MUJOCO_DIR = ${mujoco_dir}: must hold lib/libmujoco.so.2.2.2")
endif()
# Programs load a copy in the build folder: if MUJOCO_DIR disappeared, the loader would silently take
# the distribution's library, which has the same name.
if(mujoco_dir)
  if(WALKER_SIM_ROS)
    set(mujoco_copy ${CATKIN_DEVEL_PREFIX}/${CATKIN_PACKAGE_LIB_DESTINATION}/libmujoco.so.2.2.2)
  else()
    set(mujoco_copy ${CMAKE_CURRENT_BINARY_DIR}/mujoco/libmujoco.so.2.2.2)
  endif()
  configure_file(${mujoco_library} ${mujoco_copy} COPYONLY)
  set(mujoco_library ${mujoco_copy})
  file(GLOB mujoco_licences ${mujoco_dir}/*LICENSE* ${mujoco_dir}/THIRD_PARTY*)
endif()
add_library(mujoco_shared SHARED IMPORTED)
set_target_properties(mujoco_shared PROPERTIES IMPORTED_LOCATION ${mujoco_library})
target_include_directories(mujoco_shared SYSTEM INTERFACE ${mujoco_include_dir})
add_library(walker_sim_mujoco INTERFACE)
target_link_libraries(walker_sim_mujoco INTERFACE mujoco_shared)
# LD_LIBRARY_PATH may name the distribution's folder. The loader searches DT_RPATH before that variable,
# and DT_RUNPATH, which linkers write by default, after it.
target_link_options(walker_sim_mujoco INTERFACE "-Wl,--disable-new-dtags")
