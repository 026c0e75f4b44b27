// Delays, and what is measured beside a delayed observation. worlds_numpy_test.py has the values of
// pushes, errors and dropped observations.
#include "episode/disturbances.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "episode/fake_robot.h"
#include "episode/walker.h"
#include "error_message.h"

namespace walker {
namespace {

constexpr double kDt = 0.02;

/// A robot of one joint. It observes the number of its steps and the error of its joint's position,
/// and remembers actions.
class Probe : public BareRobot {
 public:
  Probe() {
    specification_.id = "BipedalWalker-v3";
    specification_.dt = kDt;
    specification_.observation_low.resize(2);
    specification_.action_low = {-1};
    specification_.joints.resize(1);
  }
  void reset(Generator& /*generator*/, double* /*info*/) override { steps = 0; }
  void step(RobotStep& step) override {
    ++steps;
    actions.push_back(*step.action);
  }
  void observe(double* observation) const override {
    observe(SensorNoise{{0}, {0}, 0, 0, {}, {}}, observation);
  }
  void observe(const SensorNoise& noise, double* observation) const override {
    observation[0] = steps;
    observation[1] = noise.joint_position[0];
  }
  void sense(Sensors& sensors) override {
    sensors.joint_position = {double(steps)};
    sensors.joint_velocity = {0};
    sensors.link_poses.resize(1);
  }

  int steps = 0;
  std::vector<double> actions;
};

class DisturbancesTest : public testing::Test {
 protected:
  /// Plays an episode with actions 1, 2, 3, ...
  void play(const World& world, int num_steps) {
    auto probe = std::make_unique<Probe>();
    probe_ = probe.get();
    walker_ = std::make_unique<Walker>(std::move(probe));
    walker_->set_world(world);
    walker_->reset(0);
    observed_ = {walker_->state().observation[0]};
    for (int i = 1; i <= num_steps; ++i) step(i);
  }
  void step(double action) {
    walker_->step({action});
    observed_.push_back(walker_->state().observation[0]);
  }

  Probe* probe_ = nullptr;
  std::unique_ptr<Walker> walker_;
  std::vector<double> observed_;
};

using Doubles = std::vector<double>;

TEST_F(DisturbancesTest, DelaysActionsByWholeSteps) {
  play({{"action_delay", {2 * kDt, 2 * kDt}}}, 5);
  EXPECT_EQ(probe_->actions, (Doubles{0, 0, 1, 2, 3}));
  EXPECT_EQ(walker_->state().action, Doubles{5});
  EXPECT_EQ(observed_, (Doubles{0, 1, 2, 3, 4, 5}));
  play({{"action_delay", {0, 0}}}, 2);
  EXPECT_EQ(probe_->actions, (Doubles{1, 2}));
}

TEST_F(DisturbancesTest, DelaysObservationsByWholeSteps) {
  play({{"observation_delay", {3 * kDt, 3 * kDt}}}, 6);
  EXPECT_EQ(observed_, (Doubles{0, 0, 0, 0, 1, 2, 3}));
  EXPECT_EQ(probe_->actions, (Doubles{1, 2, 3, 4, 5, 6}));
}

TEST_F(DisturbancesTest, MayDropAllObservationsButTheFirst) {
  play({{"dropout", {1, 1}}}, 3);
  EXPECT_EQ(observed_, (Doubles{0, 0, 0, 0}));
}

TEST_F(DisturbancesTest, MeasuresWhatItObserves) {
  play({{"observation_delay", {2 * kDt, 2 * kDt}},
        {"dropout", {0.3, 0.3}},
        {"joint_position_noise", {0.1, 0.1}}},
       0);
  for (int i = 0; i < 200; ++i) {
    const Sensors& sensors = walker_->measurements();
    const std::vector<double>& observation = walker_->state().observation;
    ASSERT_EQ(sensors.joint_position[0], observation[0] + observation[1]) << i;
    ASSERT_EQ(walker_->measured_step(), observation[0]);
    ASSERT_EQ(walker_->sensors().joint_position[0], i);  // exact and present
    step(0);
  }
}

TEST_F(DisturbancesTest, MeasuresFromTheFirstCallOn) {
  play({{"observation_delay", {2 * kDt, 2 * kDt}}}, 10);
  EXPECT_EQ(walker_->measurements().joint_position[0], 10);
  EXPECT_EQ(walker_->measured_step(), 10U);
  step(0);
  EXPECT_EQ(walker_->measurements().joint_position[0], 10);
  EXPECT_EQ(walker_->measured_step(), 10U);
  step(0);
  step(0);
  EXPECT_EQ(walker_->measurements().joint_position[0], 11);
  EXPECT_EQ(walker_->measured_step(), 11U);
}

TEST_F(DisturbancesTest, RefusesDelaysOfNoStep) {
  play({}, 0);
  for (const std::string name : {"action_delay", "observation_delay", "push_interval"}) {
    EXPECT_EQ(message_of<std::invalid_argument>([&] {
                walker_->set_world(World{{name, {0.009, 0.009}}});
              }),
              "world parameter " + name +
                  " = 0.009 s: is shorter than half a step of BipedalWalker-v3 (0.01 s)");
    walker_->set_world(World{{name, {0.01, 0.01}}});
  }
}

}  // namespace
}  // namespace walker
