// Images against Gymnasium's, and the properties of the renderer.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "error_message.h"
#include "pictures.h"
#include "robots/mujoco/player.h"
#include "stepper.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

using mujoco::Actions;

constexpr std::uint32_t kShrinking = 4;  // record_pictures.py shrinks the reference images by this

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

void expect_gymnasiums(const std::string& id, const std::string& kind, std::uint64_t seed,
                       std::uint32_t steps) {
  const std::string name =
      id + "_" + kind + "_" + std::to_string(seed) + "_" + std::to_string(steps);
  SCOPED_TRACE(name);
  const Image ours =
      shrunk(draw(*make_renderer(id), capture_of(id, kind, seed, steps)), kShrinking);
  const Image theirs = read_picture(name);
  EXPECT_GT(structural_similarity(ours, theirs), 0.96);
  EXPECT_LT(share_of_other_pixels(ours, theirs), 0.002);
}

TEST(RendererTest, EpisodesLookAsGymnasiums) {
  expect_gymnasiums("Walker2d-v4", "balance", 1, 0);
  expect_gymnasiums("Walker2d-v4", "balance", 1, 60);
  expect_gymnasiums("Walker2d-v5", "saturated", 2, 0);
  expect_gymnasiums("Walker2d-v5", "saturated", 2, 10);
  expect_gymnasiums("Walker2d-v5", "saturated", 2, 20);
}

TEST(RendererTest, DependsOnTheCaptureAlone) {
  std::vector<StateCapture> captures;
  for (const std::uint32_t steps : {0U, 7U, 15U}) {
    captures.push_back(capture_of("Walker2d-v5", "saturated", 2, steps));
  }
  const auto renderer = make_renderer("Walker2d-v5");
  std::vector<Image> forward;
  forward.reserve(captures.size());
  for (const StateCapture& captured : captures) forward.push_back(draw(*renderer, captured));
  for (std::size_t i = captures.size(); i-- > 0;) {
    EXPECT_EQ(draw(*renderer, captures[i]).rgb, forward[i].rgb) << i;
    EXPECT_EQ(draw(*make_renderer("Walker2d-v5"), captures[i]).rgb, forward[i].rgb) << i;
    EXPECT_NE(forward[i].rgb, forward[(i + 1) % forward.size()].rgb) << i;
  }
}

TEST(RendererTest, LeavesTheEpisodeUnchanged) {
  for (const char* id : {"Walker2d-v4", "Walker2d-v5"}) {
    Stepper drawn(id);
    Stepper alone(id);
    const auto renderer =
        make_renderer(id, {}, {{"width", std::int64_t{32}}, {"height", std::int64_t{24}}});
    Actions actions("balance", 1);
    StateCapture captured;
    Image image;
    std::vector<double> action;
    drawn.reset(1);
    alone.reset(1);
    std::uint32_t step = 0;
    for (; step < 150 && !alone.has_ended(); ++step) {
      capture(*drawn.environment, step, captured);
      renderer->render(captured, {true, true}, image);
      actions.draw(alone.observation, action);
      drawn.step(action);
      alone.step(action);
      ASSERT_EQ(drawn.row(), alone.row()) << id << ", step " << step;
    }
    EXPECT_EQ(step, 150U);
    drawn.reset();
    alone.reset();
    EXPECT_EQ(drawn.observation, alone.observation);
    EXPECT_EQ(drawn.environment->generator_state(), alone.environment->generator_state());
  }
}

TEST(RendererTest, DrawsLargerThanTheModelsBuffer) {
  const auto renderer = make_renderer(
      "Walker2d-v5", {}, {{"width", std::int64_t{1000}}, {"height", std::int64_t{960}}});
  const StateCapture captured = capture_of("Walker2d-v5", "saturated", 2, 10);
  const Image large = draw(*renderer, captured);
  ASSERT_EQ(large.rgb.size(), std::size_t{1000} * 960 * kColors);
  const Image same =
      draw(*make_renderer("Walker2d-v5", {}, {{"width", std::int64_t{500}}}), captured);
  EXPECT_GT(structural_similarity(shrunk(large, 2), same), 0.9);
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

}  // namespace
}  // namespace walker
