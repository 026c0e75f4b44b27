// The observation built from measurements against the environment's, and what is refused.
#include "walker_sim/observation_builder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "observer.h"
#include "robots/bipedal_walker/player.h"

namespace walker::bipedal_walker {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kBound = 1.2e-7;  // bound in observation_builder.h

TEST(ObservationBuilderTest, BuildsEveryObservation) {
  for (const char* id : {"BipedalWalker-v3", "BipedalWalkerHardcore-v3"}) {
    Observer observer(id);
    // Show that the comparison is not vacuous.
    int steps = 0;
    double furthest = 0;  // [m]
    double steepest = 0;  // [rad]
    int touching = 0;
    std::ptrdiff_t infinite = 0;
    for (const char* kind : {"random", "heuristic", "noisy", "saturated"}) {
      for (std::uint64_t seed = 0; seed < 20; ++seed) {
        SCOPED_TRACE(std::string(id) + " " + kind + ", seed " + std::to_string(seed));
        Actions actions(kind, seed);
        std::vector<double> action;
        observer.reset(seed);
        ASSERT_LE(observer.largest_difference(), kBound);
        while (!observer.walker.has_ended()) {
          actions.draw(observer.walker.observation, action);
          observer.step(action);
          const Measurements& measured = observer.measurements;
          ++steps;
          furthest = std::max(furthest, measured.position[0]);
          steepest = std::max(steepest, std::abs(observer.walker.observation[kHullAngle]));
          touching += measured.contacts[0] + measured.contacts[1];
          infinite += std::count(measured.ranges.begin(), measured.ranges.end(), kInfinity);
          ASSERT_LE(observer.largest_difference(), kBound) << "after " << steps << " steps in all";
        }
      }
    }
    EXPECT_GT(steps, 10000);
    EXPECT_GT(furthest, 20) << "nobody walked";
    EXPECT_GT(steepest, 1) << "nobody fell";
    EXPECT_GT(touching, 1000);
    EXPECT_GT(infinite, 1000);
  }
}

TEST(ObservationBuilderTest, TakesTheEnvironmentsParameters) {
  const std::string id = "BipedalWalker-v3";
  EXPECT_NO_THROW(walker::make_observation_builder(id, {{"hardcore", true}}));
  EXPECT_THROW(walker::make_observation_builder(id, {{"hardcor", true}}), std::invalid_argument);
  EXPECT_THROW(walker::make_observation_builder(id + "0"), std::invalid_argument);
}

class MeasurementsTest : public ChangedMeasurements {
 protected:
  MeasurementsTest() : ChangedMeasurements("BipedalWalker-v3") {}

  void SetUp() override {
    observer_.reset(3);
    Actions actions("heuristic", 0);
    std::vector<double> action;
    for (int i = 0; i < 40; ++i) {
      actions.draw(observer_.walker.observation, action);
      observer_.step(action);
    }
    measurements_ = observer_.measurements;
  }

  std::vector<double> build(const Measurements& measurements) {
    std::vector<double> observation(kObservationSize, -7);
    observer_.builder->build(measurements, observation.data());
    return observation;
  }

  void turn_hull(double angle) {
    measurements_.orientation = {0, -std::sin(angle / 2), 0, std::cos(angle / 2)};
  }
};

TEST_F(MeasurementsTest, PositionIsNotObserved) {
  measurements_.position = {kNaN, kNaN, kNaN};
  EXPECT_EQ(build(measurements_), observer_.built);
}

TEST_F(MeasurementsTest, WholeTurnsCountUntilTheReset) {
  for (const double direction : {1.0, -1.0}) {
    observer_.builder->reset();
    double angle = 0;
    for (int i = 0; i < 50; ++i, angle += direction * 0.9) {
      turn_hull(angle);
      EXPECT_NEAR(build(measurements_)[kHullAngle], angle, 1e-5) << i;
      for (double& value : measurements_.orientation) value = -value;  // the same attitude
      EXPECT_NEAR(build(measurements_)[kHullAngle], angle, 1e-5) << i;
    }
    EXPECT_GT(std::abs(angle), 7 * 2 * M_PI);
    observer_.builder->reset();
    EXPECT_NEAR(build(measurements_)[kHullAngle], std::remainder(angle - direction * 0.9, 2 * M_PI),
                1e-5);
  }
}

TEST_F(MeasurementsTest, RangesAreClipped) {
  for (const double range : {kLidarRange, kLidarRange + 1, 100.0, kInfinity}) {
    measurements_.ranges[4] = range;
    EXPECT_EQ(build(measurements_)[kFirstRay + 4], 1);
  }
  measurements_.ranges[4] = 0;
  EXPECT_EQ(build(measurements_)[kFirstRay + 4], 0);
}

TEST_F(MeasurementsTest, RejectsMalformedOnes) {
  using M = Measurements;
  const std::string ranges = " m; must be at least 0, or +infinity where the ray met nothing";
  const std::vector<std::pair<std::function<void(M&)>, std::string>> cases{
      {[](M& m) { m.joint_position.pop_back(); },
       "joint_position has 3 values; must have 4, one per joint"},
      {[](M& m) { m.joint_velocity.push_back(0); },
       "joint_velocity has 5 values; must have 4, one per joint"},
      {[](M& m) { m.contacts.clear(); },
       "contacts has 0 values; must have 2, one per contact link"},
      {[](M& m) { m.ranges.resize(360); }, "ranges has 360 values; must have 10, one per ray"},
      {[](M& m) { m.joint_position[2] = kNaN; },
       "joint_position[2] (hip_2) = nan rad; must be finite"},
      {[](M& m) { m.joint_velocity[1] = -kInfinity; },
       "joint_velocity[1] (knee_1) = -inf rad/s; must be finite"},
      {[](M& m) { m.angular_velocity[1] = kNaN; },
       "angular_velocity[1] = nan rad/s; must be finite"},
      {[](M& m) { m.linear_velocity[2] = kInfinity; },
       "linear_velocity[2] = inf m/s; must be finite"},
      {[](M& m) { m.ranges[9] = kNaN; }, "ranges[9] = nan" + ranges},
      {[](M& m) { m.ranges[0] = -kInfinity; }, "ranges[0] = -inf" + ranges},
      {[](M& m) { m.orientation.fill(0); },
       "orientation = (0.000000, 0.000000, 0.000000, 0.000000); must be a unit quaternion"}};
  for (const auto& [change, message] : cases) EXPECT_EQ(refusal(change), message);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NE(refusal([k](M& m) { m.orientation[k] = kNaN; }).find("unit quaternion"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace walker::bipedal_walker
