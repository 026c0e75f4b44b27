// Rendering beside other users of OpenGL: threads, renderers, the caller's current context.
#include <gtest/gtest.h>

// Must precede EGL's headers, which otherwise include X11's.
#define EGL_NO_X11
#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <array>
#include <cstdlib>
#include <future>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "base/shared_library.h"
#include "error_message.h"
#include "robots/mujoco/model_file.h"
#include "stepper.h"
#include "walker_sim/renderer.h"

namespace walker::mujoco {
namespace {

const Parameters kSmall{{"width", std::int64_t{96}}, {"height", std::int64_t{72}}};

std::unique_ptr<Renderer> make_small_renderer(const std::string& xml_file = "walker2d_v5.xml") {
  return make_renderer("Walker2d-v5", {{"xml_file", xml_file}}, kSmall);
}

std::vector<StateCapture> some_captures() {
  Stepper walker("Walker2d-v5", {{"terminate_when_unhealthy", false}});
  walker.reset(5);
  std::vector<StateCapture> captures(4);
  for (std::uint32_t i = 0; i < captures.size(); ++i) {
    for (int step = 0; step < 15; ++step) walker.step({0.5, -0.5, 0, -0.5, 0.5, 0});
    capture(*walker.environment, i, captures[i]);
  }
  return captures;
}

Image draw(Renderer& renderer, const StateCapture& captured) {
  Image image;
  renderer.render(captured, {true, true}, image);
  return image;
}

void expect_equal(const Image& a, const Image& b) {
  ASSERT_FALSE(a.rgb.empty());
  EXPECT_EQ(a.rgb, b.rgb);
  EXPECT_EQ(a.depth, b.depth);
  EXPECT_EQ(a.camera_pose.position, b.camera_pose.position);
  EXPECT_EQ(a.camera_pose.orientation, b.camera_pose.orientation);
}

std::vector<Image> draw_all(const std::vector<StateCapture>& captures) {
  const auto renderer = make_small_renderer();
  std::vector<Image> images;
  images.reserve(captures.size());
  for (const StateCapture& captured : captures) images.push_back(draw(*renderer, captured));
  return images;
}

TEST(RendererContexts, RenderersDrawInConcurrentThreads) {
  const std::vector<StateCapture> captures = some_captures();
  const std::vector<Image> alone = draw_all(captures);
  std::array<std::future<std::vector<Image>>, 4> threads;
  for (auto& thread : threads) {
    thread = std::async(std::launch::async, [&] { return draw_all(captures); });
  }
  for (auto& thread : threads) {
    const std::vector<Image> images = thread.get();
    for (std::size_t i = 0; i < captures.size(); ++i) expect_equal(images[i], alone[i]);
  }
}

TEST(RendererContexts, ARendererMovesBetweenThreads) {
  const std::vector<StateCapture> captures = some_captures();
  const std::vector<Image> alone = draw_all(captures);
  auto renderer = make_small_renderer();
  for (std::size_t i = 0; i < captures.size(); ++i) {
    std::thread([&] { expect_equal(draw(*renderer, captures[i]), alone[i]); }).join();
  }
  std::thread([&] { renderer.reset(); }).join();
}

/// Makes an OpenGL ES context current in this thread, as another library may have done.
class CallersContext {
 public:
  CallersContext() {
    display_ = call<decltype(&eglGetPlatformDisplay)>("eglGetPlatformDisplay")(
        EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    call<decltype(&eglInitialize)>("eglInitialize")(display_, nullptr, nullptr);
    call<decltype(&eglBindAPI)>("eglBindAPI")(EGL_OPENGL_ES_API);
    constexpr std::array<EGLint, 5> kWanted{EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE,
                                            EGL_OPENGL_ES2_BIT, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    call<decltype(&eglChooseConfig)>("eglChooseConfig")(display_, kWanted.data(), &config, 1,
                                                        &count);
    constexpr std::array<EGLint, 3> kVersion2{EGL_CONTEXT_CLIENT_VERSION, 2, EGL_NONE};
    context_ = call<decltype(&eglCreateContext)>("eglCreateContext")(
        display_, config, EGL_NO_CONTEXT, kVersion2.data());
    constexpr std::array<EGLint, 5> kSize{EGL_WIDTH, 8, EGL_HEIGHT, 8, EGL_NONE};
    surface_ = call<decltype(&eglCreatePbufferSurface)>("eglCreatePbufferSurface")(display_, config,
                                                                                   kSize.data());
    call<decltype(&eglMakeCurrent)>("eglMakeCurrent")(display_, surface_, surface_, context_);
  }
  CallersContext(const CallersContext&) = delete;
  CallersContext& operator=(const CallersContext&) = delete;
  ~CallersContext() {
    call<decltype(&eglMakeCurrent)>("eglMakeCurrent")(display_, EGL_NO_SURFACE, EGL_NO_SURFACE,
                                                      EGL_NO_CONTEXT);
    call<decltype(&eglDestroyContext)>("eglDestroyContext")(display_, context_);
  }

  bool is_current() const {
    const auto surface = call<decltype(&eglGetCurrentSurface)>("eglGetCurrentSurface");
    return context_ != EGL_NO_CONTEXT && surface_ != EGL_NO_SURFACE &&
           call<decltype(&eglGetCurrentContext)>("eglGetCurrentContext")() == context_ &&
           call<decltype(&eglQueryAPI)>("eglQueryAPI")() == EGL_OPENGL_ES_API &&
           surface(EGL_DRAW) == surface_ && surface(EGL_READ) == surface_;
  }

 private:
  template <typename Function>
  Function call(const char* name) const {
    return library_.function(name);
  }

  SharedLibrary library_{"libEGL.so.1", "libegl1"};
  EGLDisplay display_;
  EGLContext context_;
  EGLSurface surface_;
};

TEST(RendererContexts, LeavesTheCallersContextCurrent) {
  const std::vector<StateCapture> captures = some_captures();
  const Image alone = draw_all(captures)[0];
  const CallersContext context;
  ASSERT_TRUE(context.is_current());
  auto renderer = make_small_renderer();
  expect_equal(draw(*renderer, captures[0]), alone);
  EXPECT_TRUE(context.is_current());
  renderer.reset();
  EXPECT_TRUE(context.is_current());
}

/// MuJoCo rejects a near plane that is almost at distance 0. Later images must not be
/// affected.
TEST(RendererContexts, RestoresTheCallersContextAfterAnError) {
  const std::vector<StateCapture> captures = some_captures();
  const Image alone = draw_all(captures)[0];
  const Folder folder;
  const std::string broken =
      folder.write("broken.xml", replaced(builtin_text("walker2d_v5.xml"), "<worldbody>",
                                          "<visual><map znear=\"1e-20\"/></visual><worldbody>"));
  const auto refuses = make_small_renderer(broken);
  const auto renderer = make_small_renderer();
  const CallersContext context;
  for (int i = 0; i < 2; ++i) {
    EXPECT_NE(message_of<std::runtime_error>([&] {
                draw(*refuses, captures[0]);
              }).find("MuJoCo: mjvScene frustum_near too small"),
              std::string::npos);
    EXPECT_TRUE(context.is_current());
    expect_equal(draw(*renderer, captures[0]), alone);
  }
}

/// MuJoCo resolves OpenGL's functions once, and those of one library do not fit another's contexts.
TEST(RendererContexts, KeepsTheFirstChoice) {
  const std::vector<StateCapture> captures = some_captures();
  const Image alone = draw_all(captures)[0];
  for (const char* const library : {"osmesa", "egl", "glfw"}) {
    setenv("MUJOCO_GL", library, 1);
    expect_equal(draw_all(captures)[0], alone);
  }
}

}  // namespace
}  // namespace walker::mujoco
