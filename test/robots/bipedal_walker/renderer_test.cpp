// Properties of the renderer. Python suites compare its pictures with Gymnasium's.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "error_message.h"
#include "pictures.h"
#include "robots/bipedal_walker/player.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

using bipedal_walker::Actions;
using bipedal_walker::play;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

StateCapture capture_of(const std::string& id, const std::string& kind, std::uint64_t seed,
                        std::uint32_t step) {
  Stepper walker(id);
  play(walker, seed, Actions(kind, seed), step);
  StateCapture captured;
  capture(*walker.environment, step, captured);
  return captured;
}

Image draw(const StateCapture& captured, const Parameters& camera = {}) {
  return draw(*make_renderer("BipedalWalker-v3", {}, camera), captured);
}

std::vector<StateCapture> some_captures() {
  std::vector<StateCapture> captures;
  for (const std::uint32_t step : {0U, 9U, 40U, 150U}) {
    captures.push_back(capture_of("BipedalWalker-v3", "heuristic", 6, step));
    captures.push_back(capture_of("BipedalWalkerHardcore-v3", "heuristic", 4, step));
  }
  return captures;
}

class RendererTest : public testing::Test {
 protected:
  const std::unique_ptr<Renderer> renderer_ = make_renderer("BipedalWalker-v3");
  StateCapture captured_ = capture_of("BipedalWalker-v3", "zero", 0, 0);
  Image image_;
};

TEST_F(RendererTest, TwoThreadsCanDraw) {
  const std::vector<StateCapture> captures = some_captures();
  std::vector<Image> expected;
  expected.reserve(captures.size());
  for (const StateCapture& captured : captures) expected.push_back(draw(captured));
  const auto draw_often = [&] {
    const auto renderer = make_renderer("BipedalWalker-v3");
    for (int round = 0; round < 10; ++round) {
      for (std::size_t i = 0; i < captures.size(); ++i) {
        EXPECT_EQ(draw(*renderer, captures[i]).rgb, expected[i].rgb);
      }
    }
  };
  std::thread other(draw_often);
  draw_often();
  other.join();
}

/// Draws one lidar ray per step, in order and then in reverse, then none until the cycle of 100
/// steps ends.
TEST_F(RendererTest, StepSelectsTheRay) {
  for (Pose& link : captured_.sensors.link_poses) link.orientation = {0, 1, 0, 0};  // legs up
  const auto red_pixels = [this](std::uint32_t step) {
    captured_.step = step;
    const Image image = draw(captured_);
    int count = 0;
    for (std::size_t i = 0; i < image.rgb.size(); i += kColors) {
      count += image.rgb[i] == 255 && image.rgb[i + 1] == 0 && image.rgb[i + 2] == 0 ? 1 : 0;
    }
    return count;
  };
  const int vertical = red_pixels(99);
  EXPECT_GT(vertical, 20);
  for (std::uint32_t step = 0; step < 8; ++step) {
    EXPECT_GE(red_pixels(step), vertical) << step;
    EXPECT_EQ(red_pixels(18 - step - 1), red_pixels(step)) << step;
  }
  EXPECT_GT(red_pixels(8), 2 * vertical) << "no hit: it has its full length";
  EXPECT_EQ(red_pixels(9), red_pixels(8));
  EXPECT_EQ(red_pixels(18), vertical);
  EXPECT_EQ(red_pixels(19), 0);
  EXPECT_EQ(red_pixels(98), 0);
  EXPECT_EQ(red_pixels(1000), red_pixels(0));
}

/// The tolerance covers cairo's rounding where a shape is clipped.
TEST_F(RendererTest, WidthShowsMoreOrLessOnTheRight) {
  for (const StateCapture& captured : some_captures()) {
    const Image image = draw(captured);
    for (const std::uint32_t width : {1U, 300U, 1000U}) {
      const Image other = draw(captured, {{"width", std::int64_t{width}}});
      ASSERT_EQ(other.width, width);
      ASSERT_EQ(other.height, image.height);
      double largest = 0;
      for (std::size_t y = 0; y < image.height; ++y) {
        for (std::size_t i = 0; i < kColors * std::min(width, image.width); ++i) {
          const double difference = color_at(other, 0, y, i) - color_at(image, 0, y, i);
          largest = std::max(largest, std::abs(difference));
        }
      }
      EXPECT_LT(largest, 8) << width;
    }
  }
}

/// The hull's position projects to a pixel of the hull's colour, also 3 m left of its usual place.
TEST_F(RendererTest, CameraPoseProjectsTheHull) {
  std::vector<StateCapture> captures = some_captures();
  captures.push_back(captures[0]);
  for (Pose& link : captures.back().sensors.link_poses) link.position[0] -= 3;
  for (const std::int64_t height : {400, 700}) {
    for (const StateCapture& captured : captures) {
      const Image image = draw(captured, {{"height", height}});
      const double scale = 30.0 * static_cast<double>(height) / 400;
      const Vector3& hull = captured.sensors.link_poses[0].position;
      const Vector3& camera = image.camera_pose.position;
      const double x = image.width / 2.0 + (hull[0] - camera[0]) * scale;
      const double y = image.height / 2.0 - (hull[2] - camera[2]) * scale;
      EXPECT_LT(camera[1], 0);
      for (std::size_t color = 0; color < kColors; ++color) {
        constexpr std::array<double, kColors> kHull{127, 51, 229};
        EXPECT_EQ(color_at(image, static_cast<std::size_t>(x), static_cast<std::size_t>(y), color),
                  kHull[color])
            << "x " << x << ", y " << y;
      }
    }
  }
}

TEST_F(RendererTest, CameraIsParallelAndLooksAlongY) {
  const auto renderer =
      make_renderer("BipedalWalkerHardcore-v3", {}, {{"width", std::int64_t{320}}});
  EXPECT_EQ(renderer->camera().width, 320U);
  EXPECT_EQ(renderer->camera().height, 400U);
  EXPECT_EQ(renderer->camera().focal_length, 0);
  EXPECT_EQ(renderer->camera().near, 0);
  const Image image = draw(*renderer, captured_);
  const Quaternion expected{-std::sqrt(0.5), 0, 0, std::sqrt(0.5)};  // -pi/2 about x maps z to y
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(image.camera_pose.orientation[i], expected[i], 1e-12);
  }
}

TEST_F(RendererTest, RejectsDepth) {
  for (const bool color : {true, false}) {
    const std::string message = message_of<std::invalid_argument>([&] {
      renderer_->render(captured_, {color, true}, image_);
    });
    EXPECT_EQ(message, "depth: BipedalWalker's renderer draws only color");
  }
}

TEST_F(RendererTest, DrawsNoColorIfNoneIsRequested) {
  image_ = draw(*renderer_, captured_);
  const Pose pose = image_.camera_pose;
  renderer_->render(captured_, {false, false}, image_);
  EXPECT_TRUE(image_.rgb.empty());
  EXPECT_TRUE(image_.depth.empty());
  EXPECT_EQ(image_.width, 600U);
  EXPECT_EQ(image_.camera_pose.position, pose.position);
}

TEST_F(RendererTest, RejectsWrongParameters) {
  for (const char* name : {"width", "height", "widht"}) {
    for (const std::int64_t value : {-600, 0, 4097}) {
      const std::string message = message_of<std::invalid_argument>([&] {
        make_renderer("BipedalWalker-v3", {}, {{name, value}});
      });
      EXPECT_EQ(message.rfind("parameter " + (name + (" = " + std::to_string(value))), 0), 0U)
          << message;
    }
  }
}

TEST_F(RendererTest, RejectsACaptureOfAnotherWalker) {
  Stepper walker("Walker2d-v5");
  walker.reset(0);
  StateCapture another;
  capture(*walker.environment, 0, another);
  const std::string message =
      message_of<std::invalid_argument>([&] { renderer_->render(another, {}, image_); });
  EXPECT_EQ(message, "capture with 7 links and 10 rays; must have, as BipedalWalker, 5 and 10");
}

/// Non-finite and huge values, as a failed simulation could leave them.
TEST_F(RendererTest, DrawsNonFiniteAndHugeNumbers) {
  const auto renderer = make_renderer("BipedalWalkerHardcore-v3");
  const StateCapture sound = capture_of("BipedalWalkerHardcore-v3", "heuristic", 4, 8);
  const Image expected = draw(*renderer, sound);
  for (const double absurd : {std::nan(""), kInfinity, -kInfinity, 1e300, -1e300, 1e9, -1e9}) {
    std::vector<StateCapture> captures(4, sound);
    captures[0].sensors.link_poses[0].position[0] = absurd;
    for (Pose& link : captures[1].sensors.link_poses) link.position.fill(absurd);
    for (Pose& link : captures[2].sensors.link_poses) link.orientation.fill(absurd);
    for (ScenePolygon& ground : captures[3].scene.ground) ground.points[0][1] = absurd;
    captures[3].sensors.ranges.assign(10, absurd);
    for (const StateCapture& captured : captures) {
      const Image image = draw(*renderer, captured);
      EXPECT_EQ(image.rgb.size(), expected.rgb.size());
      EXPECT_NE(image.rgb, expected.rgb);
    }
  }
  EXPECT_EQ(draw(*renderer, sound).rgb, expected.rgb) << "nothing of it stays";
}

TEST_F(RendererTest, ReusesTheImagesMemory) {
  image_ = draw(*renderer_, captured_);
  const std::uint8_t* const memory = image_.rgb.data();
  renderer_->render(captured_, {}, image_);
  EXPECT_EQ(image_.rgb.data(), memory);
}

}  // namespace
}  // namespace walker
