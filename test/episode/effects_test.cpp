#include "episode/effects.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "episode/episode.h"
#include "episode/fake_walker.h"
#include "error_message.h"

namespace walker {
namespace {

constexpr double kDt = 0.02;

/// A robot of one joint. It observes the number of its steps and the errors that it
/// is given, and remembers actions and pushes.
class Probe : public BareRobot {
 public:
  explicit Probe(std::size_t num_rays = 1, bool has_optional_rays = false) {
    specification_.id = "BipedalWalker-v3";
    specification_.dt = kDt;
    specification_.observation_low.resize(7);
    specification_.action_low = {-1};
    specification_.joints.resize(1);
    specification_.range_finder.num_rays = num_rays;
    specification_.range_finder.is_optional = has_optional_rays;
  }
  void reset(Generator& /*generator*/, double* /*info*/) override { steps = 0; }
  void step(RobotStep& step) override {
    ++steps;
    actions.push_back(*step.action);
    pushes.push_back(step.push);
  }
  void observe(double* observation) const override {
    observe(SensorNoise{{0}, {0}, 0, 0, {}, {}}, observation);
  }
  void observe(const SensorNoise& noise, double* observation) const override {
    const std::array<double, 7> values{double(steps),
                                       noise.joint_position[0],
                                       noise.joint_velocity[0],
                                       noise.pitch,
                                       noise.angular_velocity,
                                       noise.linear_velocity[1],
                                       noise.ranges.empty() ? 0 : noise.ranges.back()};
    std::copy(values.begin(), values.end(), observation);
  }
  void sense(Sensors& sensors) override {
    sensors.joint_position = {double(steps)};
    sensors.joint_velocity = {0};
    sensors.link_poses.resize(1);
    sensors.ranges = {1};
    sensors.maximum_range = 100;
  }

  int steps = 0;
  std::vector<double> actions;
  std::vector<std::array<double, 2>> pushes;
};

class EffectsTest : public testing::Test {
 protected:
  /// Plays an episode with actions 1, 2, 3, ...
  void play(const World& world, int num_steps, std::uint64_t seed = 0) {
    auto probe = std::make_unique<Probe>();
    probe_ = probe.get();
    episode_ = std::make_unique<Episode>(std::move(probe));
    episode_->set_world(world);
    episode_->reset(seed);
    observed_ = {episode_->state().observation[0]};
    for (int i = 1; i <= num_steps; ++i) step(i);
  }
  void step(double action) {
    episode_->step({action});
    observed_.push_back(episode_->state().observation[0]);
  }

  Probe* probe_ = nullptr;
  std::unique_ptr<Episode> episode_;
  std::vector<double> observed_;
};

using Doubles = std::vector<double>;

TEST_F(EffectsTest, DelaysActionsByWholeSteps) {
  play({{"action_delay", {2 * kDt, 2 * kDt}}}, 5);
  EXPECT_EQ(probe_->actions, (Doubles{0, 0, 1, 2, 3}));
  EXPECT_EQ(episode_->state().action, Doubles{5});
  EXPECT_EQ(observed_, (Doubles{0, 1, 2, 3, 4, 5}));
  play({{"action_delay", {0, 0}}}, 2);
  EXPECT_EQ(probe_->actions, (Doubles{1, 2}));
}

TEST_F(EffectsTest, DelaysObservationsByWholeSteps) {
  play({{"observation_delay", {3 * kDt, 3 * kDt}}}, 6);
  EXPECT_EQ(observed_, (Doubles{0, 0, 0, 0, 1, 2, 3}));
  EXPECT_EQ(probe_->actions, (Doubles{1, 2, 3, 4, 5, 6}));
}

TEST_F(EffectsTest, RepeatsDroppedObservations) {
  play({{"dropout", {0.25, 0.25}}}, 4000);
  int repeated = 0;
  for (std::size_t i = 1; i < observed_.size(); ++i) {
    const bool is_repeated = observed_[i] == observed_[i - 1];
    ASSERT_TRUE(is_repeated || observed_[i] == static_cast<double>(i));
    repeated += is_repeated ? 1 : 0;
  }
  EXPECT_NEAR(repeated, 1000, 5 * std::sqrt(4000 * 0.25 * 0.75));
  play({{"dropout", {1, 1}}}, 3);
  EXPECT_EQ(observed_, (Doubles{0, 0, 0, 0}));
}

TEST_F(EffectsTest, PushesAtIntervalsInAnyDirection) {
  play({{"push_interval", {4 * kDt, 4 * kDt}}, {"push_impulse", {5, 5}}}, 8000);
  double x = 0;
  double z = 0;
  for (std::size_t i = 0; i < probe_->pushes.size(); ++i) {
    const auto [push_x, push_z] = probe_->pushes[i];
    const double impulse = std::hypot(push_x, push_z);
    if ((i + 1) % 4 == 0) {
      ASSERT_NEAR(impulse, 5, 1e-12);
    } else {
      ASSERT_EQ(impulse, 0);
    }
    x += push_x;
    z += push_z;
  }
  const double deviation = 5 * std::sqrt(0.5 * 2000);
  EXPECT_NEAR(x, 0, 5 * deviation);
  EXPECT_NEAR(z, 0, 5 * deviation);
  episode_->set_world(World{});
  episode_->reset(std::nullopt);
  step(0);
  EXPECT_EQ(probe_->pushes.back(), (std::array<double, 2>{}));
}

TEST_F(EffectsTest, AddsErrorsOfTheseDeviations) {
  const std::array<const char*, 6> names{"joint_position_noise",  "joint_velocity_noise",
                                         "orientation_noise",     "angular_velocity_noise",
                                         "linear_velocity_noise", "range_noise"};
  World world{{"action_noise", {0.3, 0.3}}};
  for (std::size_t i = 0; i < names.size(); ++i) {
    const double deviation = 0.1 * static_cast<double>(i + 1);
    world[names[i]] = {deviation, deviation};
  }
  constexpr int kSteps = 100000;
  std::array<double, 7> sum{};
  std::array<double, 7> squares{};
  const auto add = [&](std::size_t i, double value) {
    sum[i] += value;
    squares[i] += value * value;
  };
  play(world, 0);
  for (int step = 0; step < kSteps; ++step) {
    this->step(0.5);
    for (std::size_t i = 0; i < 6; ++i) {
      add(i, episode_->state().observation[i + 1] / (0.1 * static_cast<double>(i + 1)));
    }
    add(6, (probe_->actions.back() - 0.5) / 0.3);
  }
  const double root = std::sqrt(double{kSteps});
  for (std::size_t i = 0; i < sum.size(); ++i) {
    EXPECT_NEAR(sum[i] / kSteps, 0, 5 / root) << i;
    EXPECT_NEAR(squares[i] / kSteps, 1, 5 * std::sqrt(2.0) / root) << i;
  }
}

/// An optional lidar leaves the other errors as they are without it, and its own are independent.
TEST_F(EffectsTest, ErrorsOfOptionalRangesAreApart) {
  const auto errors = [this](std::size_t rays, bool is_optional, double range_noise) {
    World world{{"joint_position_noise", {1, 1}}, {"dropout", {1e-9, 1e-9}}};
    if (range_noise > 0) world["range_noise"] = {range_noise, range_noise};
    auto probe = std::make_unique<Probe>(rays, is_optional);
    episode_ = std::make_unique<Episode>(std::move(probe));
    episode_->set_world(world);
    episode_->reset(3);
    std::array<Doubles, 2> drawn;  // of the joint and of the last ray
    for (int i = 0; i < 4000; ++i) {
      drawn[0].push_back(episode_->state().observation[1]);
      drawn[1].push_back(episode_->state().observation[6]);
      episode_->step({0});
    }
    return drawn;
  };
  const auto without = errors(0, false, 0);
  const auto optional = errors(3, true, 0.5);
  EXPECT_EQ(optional[0], without[0]);
  EXPECT_EQ(errors(3, true, 0)[0], without[0]);
  EXPECT_EQ(errors(3, true, 0)[1], Doubles(4000));
  EXPECT_NE(errors(3, false, 0.5)[0], without[0]);
  double squares = 0;
  double product = 0;
  for (std::size_t i = 0; i < optional[1].size(); ++i) {
    squares += optional[1][i] * optional[1][i];
    product += i == 0 ? 0 : optional[1][i] * optional[1][i - 1];
  }
  const double root = std::sqrt(4000.0);
  EXPECT_NEAR(squares / 4000, 0.25, 0.25 * 5 * std::sqrt(2.0) / root);
  EXPECT_NEAR(product / 4000, 0, 0.25 * 5 / root);
}

TEST_F(EffectsTest, MeasuresWhatItObserves) {
  play({{"observation_delay", {2 * kDt, 2 * kDt}},
        {"dropout", {0.3, 0.3}},
        {"joint_position_noise", {0.1, 0.1}}},
       0);
  for (int i = 0; i < 200; ++i) {
    const Sensors& sensors = episode_->measurements();
    const std::vector<double>& observation = episode_->state().observation;
    ASSERT_EQ(sensors.joint_position[0], observation[0] + observation[1]) << i;
    ASSERT_EQ(episode_->measured_step(), observation[0]);
    ASSERT_EQ(episode_->sensors().joint_position[0], i);  // exact and present
    step(0);
  }
}

TEST_F(EffectsTest, MeasuresFromTheFirstCallOn) {
  play({{"observation_delay", {2 * kDt, 2 * kDt}}}, 10);
  EXPECT_EQ(episode_->measurements().joint_position[0], 10);
  EXPECT_EQ(episode_->measured_step(), 10U);
  step(0);
  EXPECT_EQ(episode_->measurements().joint_position[0], 10);
  EXPECT_EQ(episode_->measured_step(), 10U);
  step(0);
  step(0);
  EXPECT_EQ(episode_->measurements().joint_position[0], 11);
  EXPECT_EQ(episode_->measured_step(), 11U);
}

TEST_F(EffectsTest, RefusesDelaysOfNoStep) {
  play({}, 0);
  for (const std::string name : {"action_delay", "observation_delay", "push_interval"}) {
    EXPECT_EQ(message_of<std::invalid_argument>([&] {
                episode_->set_world(World{{name, {0.009, 0.009}}});
              }),
              "world parameter " + name +
                  " = 0.009 s: is shorter than half a step of BipedalWalker-v3, 0.02 s");
    episode_->set_world(World{{name, {0.01, 0.01}}});
  }
}

TEST_F(EffectsTest, DependsOnTheSeedOnly) {
  const World world{{"action_noise", {0.1, 0.5}}, {"dropout", {0, 0.5}}, {"push_interval", {1, 2}}};
  play(world, 100, 5);
  const Doubles actions = probe_->actions;
  const Doubles observed = observed_;
  const WorldValues values = episode_->world_values();
  play(world, 100, 5);
  EXPECT_EQ(probe_->actions, actions);
  EXPECT_EQ(observed_, observed);
  play(as_numbers(values), 100, 5);
  EXPECT_EQ(probe_->actions, actions);
  EXPECT_EQ(observed_, observed);
  EXPECT_EQ(episode_->world_values(), values);
  play(world, 100, 6);
  EXPECT_NE(probe_->actions, actions);
  EXPECT_NE(episode_->world_values(), values);
}

TEST_F(EffectsTest, IsAbsentWithoutAWorld) {
  play({}, 1);
  EXPECT_EQ(episode_->state().world, nullptr);
  EXPECT_EQ(episode_->world_values(), WorldValues{});
  EXPECT_EQ(episode_->generator_state(), Generator(0).state());
  play({{"gravity", {-12, -8}}}, 1);
  EXPECT_EQ(episode_->generator_state(), Generator(0).state());
}

}  // namespace
}  // namespace walker
