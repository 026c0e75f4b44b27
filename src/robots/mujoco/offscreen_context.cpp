#include "robots/mujoco/offscreen_context.h"

// Must precede EGL's headers: keeps X11's types out of them.
#define EGL_NO_X11
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/osmesa.h>
#include <dlfcn.h>

#include <array>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "base/posix.h"
#include "base/shared_library.h"
#include "base/shortest_text.h"

namespace walker::mujoco {
namespace {

[[noreturn]] void fail(const char* what, EGLint error) {
  ClassicStream text;
  text << what << " failed with EGL's error 0x" << std::hex << error;
  throw std::runtime_error(text.str());
}

struct EglFunctions {
  SharedLibrary library{"libEGL.so.1", "libegl1"};
  decltype(&eglGetProcAddress) find = library.function("eglGetProcAddress");
  decltype(&eglGetError) error = library.function("eglGetError");
  decltype(&eglQueryString) query = library.function("eglQueryString");
  decltype(&eglGetDisplay) get_display = library.function("eglGetDisplay");
  decltype(&eglInitialize) initialize = library.function("eglInitialize");
  decltype(&eglBindAPI) bind_api = library.function("eglBindAPI");
  decltype(&eglChooseConfig) choose = library.function("eglChooseConfig");
  decltype(&eglCreateContext) create = library.function("eglCreateContext");
  decltype(&eglDestroyContext) destroy = library.function("eglDestroyContext");
  decltype(&eglMakeCurrent) make_current = library.function("eglMakeCurrent");
  decltype(&eglReleaseThread) release_thread = library.function("eglReleaseThread");
};

const EglFunctions& egl() {
  static const EglFunctions kFunctions;
  return kFunctions;
}

bool has_extension(EGLDisplay display, const char* name) {
  const char* const all = egl().query(display, EGL_EXTENSIONS);
  return all != nullptr &&
         (" " + std::string(all) + " ").find(" " + std::string(name) + " ") != std::string::npos;
}

template <typename Function>
Function extension_function(const char* name) {
  return reinterpret_cast<Function>(egl().find(name));
}

/// Returns the display if it initializes, else EGL_NO_DISPLAY.
EGLDisplay initialized(EGLDisplay display) {
  if (display == EGL_NO_DISPLAY) return display;
  return egl().initialize(display, nullptr, nullptr) == EGL_TRUE ? display : EGL_NO_DISPLAY;
}

/// Returns the display of the first graphics device that works, in MuJoCo's own order.
EGLDisplay display_of_device() {
  const auto query = extension_function<PFNEGLQUERYDEVICESEXTPROC>("eglQueryDevicesEXT");
  const auto get = extension_function<PFNEGLGETPLATFORMDISPLAYEXTPROC>("eglGetPlatformDisplayEXT");
  if (query == nullptr || get == nullptr) return EGL_NO_DISPLAY;
  constexpr EGLint kMaxDevices = 32;
  std::array<EGLDeviceEXT, kMaxDevices> devices{};
  EGLint count = 0;
  if (query(kMaxDevices, devices.data(), &count) != EGL_TRUE) return EGL_NO_DISPLAY;
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

/// The display is never terminated, because other users of EGL in this process may share it.
EGLDisplay open_display() {
  EGLDisplay display = display_of_device();
  if (display == EGL_NO_DISPLAY) display = display_without_device();
  if (display == EGL_NO_DISPLAY) display = initialized(egl().get_display(EGL_DEFAULT_DISPLAY));
  if (display == EGL_NO_DISPLAY) {
    throw std::runtime_error("no EGL device or platform works (is libgl1-mesa-dri installed?)");
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
    const bool is_chosen = egl().choose(display_, kWanted.data(), &config, 1, &count) == EGL_TRUE;
    if (!is_chosen || count == 0) fail("eglChooseConfig", egl().error());
    bind_opengl();
    context_ = egl().create(display_, config, EGL_NO_CONTEXT, nullptr);
    if (context_ == EGL_NO_CONTEXT) fail("eglCreateContext", egl().error());
    // Only after success: MuJoCo takes OpenGL from the first library that it finds in the process.
    egl().library.make_global();
  }

  ~EglContext() override { egl().destroy(display_, context_); }

  void make_current() override {
    bind_opengl();
    if (egl().make_current(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) != EGL_TRUE) {
      fail("eglMakeCurrent", egl().error());
    }
  }

  void release() noexcept override {
    egl().make_current(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    egl().release_thread();
  }

 private:
  /// EGL stores the bound API per thread.
  static void bind_opengl() {
    if (egl().bind_api(EGL_OPENGL_API) != EGL_TRUE) fail("eglBindAPI", egl().error());
  }

  EGLDisplay display_;
  EGLContext context_;
};

struct OsmesaFunctions {
  OsmesaFunctions() { library.make_global(); }  // MuJoCo looks for OpenGL in the global scope

  SharedLibrary library{"libOSMesa.so.8", "libosmesa6"};
  decltype(&OSMesaCreateContextExt) create = library.function("OSMesaCreateContextExt");
  decltype(&OSMesaMakeCurrent) make_current = library.function("OSMesaMakeCurrent");
  decltype(&OSMesaDestroyContext) destroy = library.function("OSMesaDestroyContext");
};

const OsmesaFunctions& osmesa() {
  static const OsmesaFunctions kFunctions;
  return kFunctions;
}

class OsmesaContext : public OffscreenContext {
 public:
  OsmesaContext() {
    if (dlsym(RTLD_DEFAULT, "eglGetProcAddress") != nullptr) {
      throw std::runtime_error(
          "another part of this process has loaded EGL globally, where MuJoCo looks for OpenGL "
          "first");
    }
    constexpr int kDepthBits = 24;
    constexpr int kStencilBits = 8;
    context_ = osmesa().create(OSMESA_RGBA, kDepthBits, kStencilBits, 0, nullptr);
    if (context_ == nullptr) throw std::runtime_error("OSMesaCreateContextExt failed");
  }

  ~OsmesaContext() override { osmesa().destroy(context_); }

  void make_current() override {
    if (osmesa().make_current(context_, surface_.data(), GL_UNSIGNED_BYTE, 1, 1) == 0) {
      throw std::runtime_error("OSMesaMakeCurrent failed");
    }
  }

  void release() noexcept override { osmesa().make_current(nullptr, nullptr, 0, 0, 0); }

 private:
  OSMesaContext context_;
  std::array<unsigned char, 4> surface_{};  // one unused pixel
};

using Make = std::unique_ptr<OffscreenContext> (*)();

template <typename Context>
std::unique_ptr<OffscreenContext> make() {
  return std::make_unique<Context>();
}

struct Backend {
  const char* name;
  const char* other;  // value of MUJOCO_GL that excludes this one
  Make make;
};

/// Returns the factory of the first kind of context that works.
Make choose() {
  const char* const given = std::getenv("MUJOCO_GL");
  const std::string wanted = given == nullptr ? "" : given;
  std::string failures;
  for (const Backend& backend : {Backend{"EGL", "osmesa", make<EglContext>},  //
                                 Backend{"OSMesa", "egl", make<OsmesaContext>}}) {
    if (wanted == backend.other) continue;
    try {
      backend.make();
      return backend.make;
    } catch (const std::runtime_error& error) {
      failures += std::string("; ") + backend.name + ": " + error.what();
    }
  }
  throw std::runtime_error(
      "no OpenGL, which MuJoCo draws pictures with: install the packages libegl1, libegl-mesa0 and "
      "libgl1-mesa-dri, or libosmesa6" +
      failures);
}

}  // namespace

std::unique_ptr<OffscreenContext> make_offscreen_context() {
  refuse_pictures_in_fork();
  static const Make kMake = choose();  // once, as MuJoCo loads OpenGL's functions once
  return kMake();
}

bool has_drawn_before_fork() {
  static const unsigned kNumForks = num_forks();
  return num_forks() != kNumForks;
}

void refuse_pictures_in_fork() {
  if (!has_drawn_before_fork()) return;
  throw std::runtime_error(
      "the parent process had drawn a picture before it forked this one, and OpenGL does not "
      "outlive a fork: draw the first picture after the fork, or start this process by spawn or "
      "forkserver");
}

}  // namespace walker::mujoco
