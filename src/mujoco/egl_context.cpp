#include "mujoco/egl_context.h"

// Before EGL's headers: without the types of X11's.
#define EGL_NO_X11
#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <array>
#include <cstring>
#include <sstream>
#include <stdexcept>
#include <string>

#include "core/shared_library.h"

namespace walker::mujoco {
namespace {

[[noreturn]] void fail(const char* what, EGLint error) {
  std::ostringstream text;
  text << what << " failed with EGL's error 0x" << std::hex << error;
  throw std::runtime_error(text.str());
}

struct Functions {
  SharedLibrary library{"libEGL.so.1", "libegl1"};
  decltype(&eglGetProcAddress) find = library.function<decltype(find)>("eglGetProcAddress");
  decltype(&eglGetError) error = library.function<decltype(error)>("eglGetError");
  decltype(&eglQueryString) query = library.function<decltype(query)>("eglQueryString");
  decltype(&eglGetDisplay) get_display = library.function<decltype(get_display)>("eglGetDisplay");
  decltype(&eglInitialize) initialize = library.function<decltype(initialize)>("eglInitialize");
  decltype(&eglBindAPI) bind_api = library.function<decltype(bind_api)>("eglBindAPI");
  decltype(&eglChooseConfig) choose = library.function<decltype(choose)>("eglChooseConfig");
  decltype(&eglCreateContext) create = library.function<decltype(create)>("eglCreateContext");
  decltype(&eglDestroyContext) destroy = library.function<decltype(destroy)>("eglDestroyContext");
  decltype(&eglMakeCurrent) make_current =
      library.function<decltype(make_current)>("eglMakeCurrent");
  decltype(&eglReleaseThread) release_thread =
      library.function<decltype(release_thread)>("eglReleaseThread");
};

const Functions& functions() {
  static const Functions kFunctions;
  return kFunctions;
}

bool has_extension(EGLDisplay display, const char* name) {
  const char* const all = functions().query(display, EGL_EXTENSIONS);
  return all != nullptr &&
         (" " + std::string(all) + " ").find(" " + std::string(name) + " ") != std::string::npos;
}

template <typename Function>
Function extension_function(const char* name) {
  return reinterpret_cast<Function>(functions().find(name));
}

/// The display where it can be used, else none.
EGLDisplay initialized(EGLDisplay display) {
  if (display == EGL_NO_DISPLAY) return display;
  return functions().initialize(display, nullptr, nullptr) == EGL_TRUE ? display : EGL_NO_DISPLAY;
}

/// Of the first graphics device that works: MuJoCo's own order.
EGLDisplay display_of_device() {
  const auto query = extension_function<PFNEGLQUERYDEVICESEXTPROC>("eglQueryDevicesEXT");
  const auto get = extension_function<PFNEGLGETPLATFORMDISPLAYEXTPROC>("eglGetPlatformDisplayEXT");
  if (query == nullptr || get == nullptr) return EGL_NO_DISPLAY;
  constexpr EGLint kMostDevices = 32;
  std::array<EGLDeviceEXT, kMostDevices> devices{};
  EGLint count = 0;
  if (query(kMostDevices, devices.data(), &count) != EGL_TRUE) return EGL_NO_DISPLAY;
  for (EGLint i = 0; i < count; ++i) {
    EGLDisplay const display =
        initialized(get(EGL_PLATFORM_DEVICE_EXT, devices[static_cast<std::size_t>(i)], nullptr));
    if (display != EGL_NO_DISPLAY) return display;
  }
  return EGL_NO_DISPLAY;
}

EGLDisplay display_without_device() {
  const auto get = extension_function<PFNEGLGETPLATFORMDISPLAYEXTPROC>("eglGetPlatformDisplayEXT");
  if (get == nullptr || !has_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless")) {
    return EGL_NO_DISPLAY;
  }
  return initialized(get(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
}

/// Never terminated: whoever else in this process draws by EGL may have the same.
EGLDisplay open_display() {
  EGLDisplay display = display_of_device();
  if (display == EGL_NO_DISPLAY) display = display_without_device();
  if (display == EGL_NO_DISPLAY)
    display = initialized(functions().get_display(EGL_DEFAULT_DISPLAY));
  if (display == EGL_NO_DISPLAY) {
    throw std::runtime_error(
        "no device or platform of EGL's works (is libgl1-mesa-dri installed?)");
  }
  if (!has_extension(display, "EGL_KHR_surfaceless_context")) {
    throw std::runtime_error("EGL here has no EGL_KHR_surfaceless_context");
  }
  return display;
}

class EglContext : public OffscreenContext {
 public:
  EglContext() : display_(open_display()) {
    constexpr EGLint kColorBits = 8;
    constexpr EGLint kDepthBits = 24;
    constexpr std::array<EGLint, 13> kWanted{
        EGL_RED_SIZE,        kColorBits,     EGL_GREEN_SIZE, kColorBits,       EGL_BLUE_SIZE,
        kColorBits,          EGL_DEPTH_SIZE, kDepthBits,     EGL_SURFACE_TYPE, EGL_PBUFFER_BIT,
        EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    const bool is_chosen =
        functions().choose(display_, kWanted.data(), &config, 1, &count) == EGL_TRUE;
    if (!is_chosen || count == 0) fail("eglChooseConfig", functions().error());
    bind_opengl();
    context_ = functions().create(display_, config, EGL_NO_CONTEXT, nullptr);
    if (context_ == EGL_NO_CONTEXT) fail("eglCreateContext", functions().error());
    // Not before it works: MuJoCo takes OpenGL from the first library that it finds in the process.
    functions().library.make_global();
  }

  ~EglContext() override { functions().destroy(display_, context_); }

  void make_current() override {
    bind_opengl();
    if (functions().make_current(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) != EGL_TRUE) {
      fail("eglMakeCurrent", functions().error());
    }
  }

  void release() noexcept override {
    functions().make_current(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    functions().release_thread();
  }

 private:
  /// EGL remembers it by thread.
  static void bind_opengl() {
    if (functions().bind_api(EGL_OPENGL_API) != EGL_TRUE) fail("eglBindAPI", functions().error());
  }

  EGLDisplay display_;
  EGLContext context_;
};

}  // namespace

std::unique_ptr<OffscreenContext> make_egl_context() { return std::make_unique<EglContext>(); }

}  // namespace walker::mujoco
