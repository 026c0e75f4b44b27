// Properties of the renderer, and rendering beside other users of OpenGL: threads, renderers, the
// caller's current context. Python suites compare its pictures with Gymnasium's.
#include <gtest/gtest.h>

// Must precede EGL's headers, which otherwise include X11's.
#define EGL_NO_X11
#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <future>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "base/shared_library.h"
#include "error_message.h"
#include "pictures.h"
#include "robots/mujoco/model_file.h"
#include "robots/mujoco/player.h"
#include "stepper.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

using mujoco::Actions;

StateCapture capture_of(const std::string& id, const std::string& kind, std::uint64_t seed,
                        std::uint32_t steps) {
  Stepper walker(id);
  Actions actions(kind, seed);
  std::vector<double> action;
  walker.reset(seed);
  for (std::uint32_t i = 0; i < steps; ++i) {
    actions.draw(walker.observation, action);
    walker.step(action);
  }
  StateCapture captured;
  capture(*walker.environment, steps, captured);
  return captured;
}

TEST(RendererTest, RejectsWrongParameters) {
  const auto message = [](const Parameters& camera) {
    return message_of<std::invalid_argument>(
        [&camera] { make_renderer("Walker2d-v5", {}, camera); });
  };
  EXPECT_EQ(message({{"camera_id", std::int64_t{1}}}),
            "parameter camera_id = 1: no such camera; the model has 0 track");
  EXPECT_EQ(message({{"camera_name", std::string("front")}}),
            "parameter camera_name = front: no such camera; the model has 0 track");
  constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::pair<const char*, ParameterValue>> wrong{
      {"width", std::int64_t{0}},
      {"height", std::int64_t{4097}},
      {"distance", 0.0},
      {"elevation", 91.0},
      {"azimuth", kNothing},
      {"lookat", std::vector<double>{0, 1}},
      {"camera_id", std::int64_t{-2}},
      {"max_geom", std::int64_t{0}},
      {"camera_name", std::int64_t{0}},
  };
  for (const auto& [name, value] : wrong) {
    const std::string text = message({{name, value}});
    EXPECT_NE(text.find(std::string("parameter ") + name + " = " + to_string(value)),
              std::string::npos)
        << name << ": " << text;
  }
}

TEST(RendererTest, RejectsACaptureOfAnotherRobot) {
  const auto renderer = make_renderer("Walker2d-v5");
  Stepper walker("BipedalWalker-v3");
  walker.reset(0);
  StateCapture captured;
  capture(*walker.environment, 0, captured);
  Image image;
  EXPECT_EQ(message_of<std::invalid_argument>([&] { renderer->render(captured, {}, image); }),
            "instant with 4 joints and 5 links: not one of Walker2d");
}

TEST(RendererTest, RejectsNonFiniteCaptures) {
  const auto renderer = make_renderer("Walker2d-v5");
  const StateCapture sound = capture_of("Walker2d-v5", "zero", 1, 0);
  const Image expected = draw(*renderer, sound);
  Image image;
  for (const double absurd : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    StateCapture captured = sound;
    captured.sensors.link_poses[0].position[0] = absurd;
    EXPECT_EQ(message_of<std::invalid_argument>([&] { renderer->render(captured, {}, image); }),
              "instant with a number that is not finite");
  }
  EXPECT_EQ(draw(*renderer, sound).rgb, expected.rgb);
}

// ---------------------------------------------------------------- beside other users of OpenGL

std::unique_ptr<Renderer> make_small_renderer(const std::string& xml_file = "walker2d_v5.xml") {
  return make_renderer("Walker2d-v5", {{"xml_file", xml_file}},
                       {{"width", std::int64_t{96}}, {"height", std::int64_t{72}}});
}

std::vector<StateCapture> standing_captures() {
  std::vector<StateCapture> captures;
  for (const std::uint32_t steps : {15U, 30U, 45U, 60U}) {
    captures.push_back(capture_of("Walker2d-v5", "balance", 1, steps));
  }
  return captures;
}

Image draw_both(Renderer& renderer, const StateCapture& captured) {
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
  for (const StateCapture& captured : captures) images.push_back(draw_both(*renderer, captured));
  return images;
}

TEST(RendererContexts, RenderersDrawInConcurrentThreads) {
  const std::vector<StateCapture> captures = standing_captures();
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
  const std::vector<StateCapture> captures = standing_captures();
  const std::vector<Image> alone = draw_all(captures);
  auto renderer = make_small_renderer();
  for (std::size_t i = 0; i < captures.size(); ++i) {
    std::thread([&] { expect_equal(draw_both(*renderer, captures[i]), alone[i]); }).join();
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
  const std::vector<StateCapture> captures = standing_captures();
  const Image alone = draw_all(captures)[0];
  const CallersContext context;
  ASSERT_TRUE(context.is_current());
  auto renderer = make_small_renderer();
  expect_equal(draw_both(*renderer, captures[0]), alone);
  EXPECT_TRUE(context.is_current());
  renderer.reset();
  EXPECT_TRUE(context.is_current());
}

/// MuJoCo rejects a near plane that is almost at distance 0. Later images must not be
/// affected.
TEST(RendererContexts, RestoresTheCallersContextAfterAnError) {
  const std::vector<StateCapture> captures = standing_captures();
  const Image alone = draw_all(captures)[0];
  const Folder folder;
  const std::string broken = folder.write(
      "broken.xml", mujoco::replaced(mujoco::builtin_text("walker2d_v5.xml"), "<worldbody>",
                                     "<visual><map znear=\"1e-20\"/></visual><worldbody>"));
  const auto refuses = make_small_renderer(broken);
  const auto renderer = make_small_renderer();
  const CallersContext context;
  for (int i = 0; i < 2; ++i) {
    EXPECT_NE(message_of<std::runtime_error>([&] {
                draw_both(*refuses, captures[0]);
              }).find("MuJoCo: mjvScene frustum_near too small"),
              std::string::npos);
    EXPECT_TRUE(context.is_current());
    expect_equal(draw_both(*renderer, captures[0]), alone);
  }
}

/// MuJoCo resolves OpenGL's functions once, and those of one library do not fit another's contexts.
TEST(RendererContexts, KeepsTheFirstChoice) {
  const std::vector<StateCapture> captures = standing_captures();
  const Image alone = draw_all(captures)[0];
  for (const char* const library : {"osmesa", "egl", "glfw"}) {
    setenv("MUJOCO_GL", library, 1);
    expect_equal(draw_all(captures)[0], alone);
  }
}

}  // namespace
}  // namespace walker
