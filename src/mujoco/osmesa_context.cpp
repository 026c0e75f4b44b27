#include "mujoco/osmesa_context.h"

#include <GL/osmesa.h>
#include <dlfcn.h>

#include <array>
#include <stdexcept>

#include "core/shared_library.h"

namespace walker::mujoco {
namespace {

struct Functions {
  Functions() { library.make_global(); }  // MuJoCo looks for OpenGL there

  SharedLibrary library{"libOSMesa.so.8", "libosmesa6"};
  decltype(&OSMesaCreateContextExt) create =
      library.function<decltype(create)>("OSMesaCreateContextExt");
  decltype(&OSMesaMakeCurrent) make_current =
      library.function<decltype(make_current)>("OSMesaMakeCurrent");
  decltype(&OSMesaDestroyContext) destroy =
      library.function<decltype(destroy)>("OSMesaDestroyContext");
};

const Functions& functions() {
  static const Functions kFunctions;
  return kFunctions;
}

class OsmesaContext : public OffscreenContext {
 public:
  OsmesaContext() {
    if (dlsym(RTLD_DEFAULT, "eglGetProcAddress") != nullptr) {
      throw std::runtime_error(
          "another part of this process has loaded EGL for all to see, where "
          "MuJoCo looks for OpenGL first");
    }
    constexpr int kDepthBits = 24;
    constexpr int kStencilBits = 8;
    context_ = functions().create(OSMESA_RGBA, kDepthBits, kStencilBits, 0, nullptr);
    if (context_ == nullptr) throw std::runtime_error("OSMesaCreateContextExt failed");
  }

  ~OsmesaContext() override { functions().destroy(context_); }

  void make_current() override {
    if (functions().make_current(context_, surface_.data(), GL_UNSIGNED_BYTE, 1, 1) == 0) {
      throw std::runtime_error("OSMesaMakeCurrent failed");
    }
  }

  void release() noexcept override { functions().make_current(nullptr, nullptr, 0, 0, 0); }

 private:
  OSMesaContext context_;
  std::array<unsigned char, 4> surface_{};  // one pixel, which nobody looks at
};

}  // namespace

std::unique_ptr<OffscreenContext> make_osmesa_context() {
  return std::make_unique<OsmesaContext>();
}

}  // namespace walker::mujoco
