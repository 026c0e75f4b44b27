// The observation built from measurements against the environment's, and the use of each sensor.
#include "walker_sim/observation_builder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "error_message.h"
#include "observer.h"
#include "robots/bipedal_walker/player.h"

namespace walker::bipedal_walker {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kBound = 1.2e-7;  // bound in observation_builder.h

/// Statistics of the compared episodes, which show that the comparison is not vacuous.
struct Seen {
  int steps = 0;
  double furthest = 0;  // [m]
  double steepest = 0;  // [rad]
  int touching = 0;
  int infinite = 0;
};

void watch(const Observer& observer, Seen& seen) {
  const std::vector<double>& ranges = observer.measurements.ranges;
  ++seen.steps;
  seen.furthest = std::max(seen.furthest, observer.measurements.position[0]);
  seen.steepest = std::max(seen.steepest, std::abs(observer.walker.observation[kHullAngle]));
  seen.touching += observer.measurements.contacts[0] + observer.measurements.contacts[1];
  seen.infinite += static_cast<int>(std::count(ranges.begin(), ranges.end(), kInfinity));
}

class ObservationBuilderTest : public testing::TestWithParam<std::string> {};

TEST_P(ObservationBuilderTest, MakesTheEnvironmentsObservationOfEveryStep) {
  constexpr std::uint64_t kSeeds = 20;
  Observer observer(GetParam());
  Seen seen;
  for (const char* kind : {"random", "heuristic", "noisy", "saturated"}) {
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
      Actions actions(kind, seed);
      std::vector<double> action;
      observer.reset(seed);
      ASSERT_LE(observer.largest_difference(), kBound) << kind << ", seed " << seed;
      while (!observer.walker.has_ended()) {
        actions.draw(observer.walker.observation, action);
        observer.step(action);
        watch(observer, seen);
        ASSERT_LE(observer.largest_difference(), kBound)
            << kind << ", seed " << seed << " after " << seen.steps << " steps in all";
      }
    }
  }
  EXPECT_GT(seen.steps, 10000);
  EXPECT_GT(seen.furthest, 20) << "nobody walked";
  EXPECT_GT(seen.steepest, 1) << "nobody fell";
  EXPECT_GT(seen.touching, 1000);
  EXPECT_GT(seen.infinite, 1000);
}

TEST_P(ObservationBuilderTest, TakesTheEnvironmentsParameters) {
  EXPECT_NO_THROW(make_observation_builder(GetParam(), {{"hardcore", true}}));
  EXPECT_NE(message_of<std::invalid_argument>([] {
              make_observation_builder(GetParam(), {{"hardcor", true}});
            }).find("did you mean hardcore?"),
            std::string::npos);
  EXPECT_NE(message_of<std::invalid_argument>([] {
              make_observation_builder(GetParam() + "0");
            }).find("did you mean " + GetParam()),
            std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(Ids, ObservationBuilderTest,
                         testing::Values("BipedalWalker-v3", "BipedalWalkerHardcore-v3"),
                         [](const testing::TestParamInfo<std::string>& of) {
                           return of.index == 0 ? "plain" : "hardcore";
                         });

class MeasurementsTest : public testing::Test {
 protected:
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

  std::vector<std::size_t> changed_by(const std::function<void(Measurements&)>& change) const {
    return observer_.changed_by(measurements_, change);
  }

  std::string refusal(const std::function<void(Measurements&)>& change) {
    Measurements other = measurements_;
    change(other);
    std::vector<double> observation(kObservationSize, -7);
    std::string message = message_of<std::invalid_argument>(
        [&] { observer_.builder->build(other, observation.data()); });
    EXPECT_EQ(observation, std::vector<double>(kObservationSize, -7)) << "untouched";
    return message;
  }

  void turn_hull(double angle) {
    measurements_.orientation = {0, -std::sin(angle / 2), 0, std::cos(angle / 2)};
  }

  Observer observer_{"BipedalWalker-v3"};
  Measurements measurements_;
};

using Places = std::vector<std::size_t>;

TEST_F(MeasurementsTest, EachGoesIntoItsPlace) {
  for (std::size_t i = 0; i < kJointCount; ++i) {
    const std::size_t place = (i < 2 ? kFirstLeg : kSecondLeg) + 2 * (i % 2);
    EXPECT_EQ(changed_by([i](Measurements& m) { m.joint_position[i] += 0.1; }), Places{place});
    EXPECT_EQ(changed_by([i](Measurements& m) { m.joint_velocity[i] += 0.1; }), Places{place + 1});
  }
  for (std::size_t leg = 0; leg < 2; ++leg) {
    EXPECT_EQ(changed_by([leg](Measurements& m) { m.contacts[leg] ^= 1; }),
              Places{(leg == 0 ? kFirstLeg : kSecondLeg) + 4});
  }
  for (std::size_t ray = 0; ray < kLidarRays; ++ray) {
    EXPECT_EQ(changed_by([ray](Measurements& m) { m.ranges[ray] = 0.5; }), Places{kFirstRay + ray});
  }
  EXPECT_EQ(changed_by([](Measurements& m) {
              m.orientation = {0, std::sin(0.2), 0, std::cos(0.2)};
            }),
            (Places{kHullAngle, kHorizontalSpeed, kVerticalSpeed}));
  // The centre of mass is not at the origin, so the hull's rotation changes its velocity.
  EXPECT_EQ(changed_by([](Measurements& m) { m.angular_velocity[1] += 1; }),
            (Places{kHullAngularVelocity, kHorizontalSpeed, kVerticalSpeed}));
  for (const std::size_t k : {0U, 2U}) {
    EXPECT_EQ(changed_by([k](Measurements& m) { m.linear_velocity[k] += 0.1; }),
              (Places{kHorizontalSpeed, kVerticalSpeed}));
  }
}

TEST_F(MeasurementsTest, WhereTheWalkerIsItDoesNotObserve) {
  EXPECT_EQ(changed_by([](Measurements& m) { m.position = {kNaN, kNaN, kNaN}; }), Places{});
}

TEST_F(MeasurementsTest, SignsAndScalesAreTheEnvironments) {
  turn_hull(0.5);
  measurements_.linear_velocity = {2, 0, 0};
  measurements_.angular_velocity = {0, 0, 0};
  std::vector<double> observation = build(measurements_);
  EXPECT_NEAR(observation[kHullAngle], 0.5, 1e-7);
  EXPECT_EQ(observation[kHullAngularVelocity], 0);
  // Velocity in m/s times 0.3 x 20 m / 50 Hz forward, times 0.3 x 13.3 m / 50 Hz up.
  EXPECT_NEAR(observation[kHorizontalSpeed], 0.12 * 2 * std::cos(0.5), 1e-7);
  EXPECT_NEAR(observation[kVerticalSpeed], 0.08 * 2 * std::sin(0.5), 1e-7);
  measurements_.angular_velocity = {0, -3, 0};  // about -y: the nose rises
  observation = build(measurements_);
  EXPECT_NEAR(observation[kHullAngularVelocity], 0.04 * 3, 1e-7);
}

TEST_F(MeasurementsTest, WholeTurnsAreCountedUntilTheReset) {
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

TEST_F(MeasurementsTest, BeyondTheLidarsRangeThereIsNothing) {
  for (const double range : {kLidarRange, kLidarRange + 1, 100.0, kInfinity}) {
    measurements_.ranges[4] = range;
    EXPECT_EQ(build(measurements_)[kFirstRay + 4], 1);
  }
  measurements_.ranges[4] = 0;
  EXPECT_EQ(build(measurements_)[kFirstRay + 4], 0);
}

TEST_F(MeasurementsTest, WrongSizesAreRefused) {
  EXPECT_EQ(refusal([](Measurements& m) { m.joint_position.pop_back(); }),
            "joint_position has 3 values; must have 4, one per joint");
  EXPECT_EQ(refusal([](Measurements& m) { m.joint_velocity.push_back(0); }),
            "joint_velocity has 5 values; must have 4, one per joint");
  EXPECT_EQ(refusal([](Measurements& m) { m.contacts.clear(); }),
            "contacts has 0 values; must have 2, one per contact link");
  EXPECT_EQ(refusal([](Measurements& m) { m.ranges.resize(360); }),
            "ranges has 360 values; must have 10, one per ray");
}

TEST_F(MeasurementsTest, WhatIsNoNumberIsRefused) {
  EXPECT_EQ(refusal([](Measurements& m) { m.joint_position[2] = kNaN; }),
            "joint_position[2] (hip_2) = nan rad; must be finite");
  EXPECT_EQ(refusal([](Measurements& m) { m.joint_velocity[1] = -kInfinity; }),
            "joint_velocity[1] (knee_1) = -inf rad/s; must be finite");
  EXPECT_EQ(refusal([](Measurements& m) { m.angular_velocity[1] = kNaN; }),
            "angular_velocity[1] = nan rad/s; must be finite");
  EXPECT_EQ(refusal([](Measurements& m) { m.linear_velocity[2] = kInfinity; }),
            "linear_velocity[2] = inf m/s; must be finite");
  const std::string ranges = " m; must be at least 0, or +infinity where the ray met nothing";
  EXPECT_EQ(refusal([](Measurements& m) { m.ranges[9] = kNaN; }), "ranges[9] = nan" + ranges);
  EXPECT_EQ(refusal([](Measurements& m) { m.ranges[0] = -kInfinity; }),
            "ranges[0] = -inf" + ranges);
}

TEST_F(MeasurementsTest, AnOrientationThatIsNoneIsRefused) {
  EXPECT_EQ(refusal([](Measurements& m) {
              m.orientation = {0, 0, 0, 0};
            }),
            "orientation = (0.000000, 0.000000, 0.000000, 0.000000); must be a unit quaternion");
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NE(refusal([k](Measurements& m) { m.orientation[k] = kNaN; }).find("unit quaternion"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace walker::bipedal_walker
