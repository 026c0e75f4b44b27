#include "walker2d/offscreen_context.h"

#include <cstdlib>
#include <stdexcept>
#include <string>

#include "walker2d/egl_context.h"
#include "walker2d/osmesa_context.h"

namespace walker::walker2d {

std::unique_ptr<OffscreenContext> make_offscreen_context() {
  const char* const given = std::getenv("MUJOCO_GL");
  const std::string wish = given == nullptr ? "" : given;
  std::string failures;
  if (wish != "osmesa") {
    try {
      return make_egl_context();
    } catch (const std::runtime_error& error) {
      failures += std::string("; EGL: ") + error.what();
    }
  }
  if (wish != "egl") {
    try {
      return make_osmesa_context();
    } catch (const std::runtime_error& error) {
      failures += std::string("; OSMesa: ") + error.what();
    }
  }
  throw std::runtime_error(
      "no OpenGL, which MuJoCo draws pictures with: install the packages libegl1, libegl-mesa0 and "
      "libgl1-mesa-dri, or libosmesa6" +
      failures);
}

}  // namespace walker::walker2d
