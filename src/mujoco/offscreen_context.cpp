#include "mujoco/offscreen_context.h"

#include <cstdlib>
#include <stdexcept>
#include <string>

#include "mujoco/egl_context.h"
#include "mujoco/osmesa_context.h"

namespace walker::mujoco {

namespace {

using Make = std::unique_ptr<OffscreenContext> (*)();

/// The way that works here.
Make choose() {
  const char* const given = std::getenv("MUJOCO_GL");
  const std::string wish = given == nullptr ? "" : given;
  std::string failures;
  if (wish != "osmesa") {
    try {
      make_egl_context();
      return make_egl_context;
    } catch (const std::runtime_error& error) {
      failures += std::string("; EGL: ") + error.what();
    }
  }
  if (wish != "egl") {
    try {
      make_osmesa_context();
      return make_osmesa_context;
    } catch (const std::runtime_error& error) {
      failures += std::string("; OSMesa: ") + error.what();
    }
  }
  throw std::runtime_error(
      "no OpenGL, which MuJoCo draws pictures with: install the packages libegl1, libegl-mesa0 and "
      "libgl1-mesa-dri, or libosmesa6" +
      failures);
}

}  // namespace

std::unique_ptr<OffscreenContext> make_offscreen_context() {
  static const Make kMake = choose();  // once, as MuJoCo looks for OpenGL's functions
  return kMake();
}

}  // namespace walker::mujoco
