# Eigen (headers only), for policies and poses.
find_package(Eigen3 QUIET NO_MODULE)
if(NOT TARGET Eigen3::Eigen)
  message(FATAL_ERROR "Eigen/Core not found: install libeigen3-dev")
endif()

# walker_sim_pictures: headers of the rendering libraries, which the first picture loads.
find_path(CAIRO_INCLUDE_DIR cairo.h PATH_SUFFIXES cairo)
find_path(EGL_INCLUDE_DIR EGL/egl.h)
find_path(OSMESA_INCLUDE_DIR GL/osmesa.h)
if(NOT CAIRO_INCLUDE_DIR OR NOT EGL_INCLUDE_DIR OR NOT OSMESA_INCLUDE_DIR)
  message(FATAL_ERROR "Headers for pictures not found: cairo.h in ${CAIRO_INCLUDE_DIR}, EGL/egl.h in "
    "${EGL_INCLUDE_DIR}, GL/osmesa.h in ${OSMESA_INCLUDE_DIR}; all are needed: install "
    "libcairo2-dev, libegl-dev and libosmesa6-dev")
endif()
add_library(walker_sim_pictures INTERFACE)
target_include_directories(walker_sim_pictures
  SYSTEM INTERFACE ${CAIRO_INCLUDE_DIR} ${EGL_INCLUDE_DIR} ${OSMESA_INCLUDE_DIR})
