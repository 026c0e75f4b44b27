// The observation built from measurements against the environment's, also for a user's model.
#include "walker_sim/observation_builder.h"
#include "walker_sim/agent.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "observer.h"
#include "robots/mujoco/model_file.h"
#include "robots/mujoco/other_walker.h"
#include "robots/mujoco/player.h"

namespace walker::mujoco {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// Bounds in observation_builder.h.
constexpr double kBound = 1e-12;
constexpr double kRangeBound = 1.2e-7;

/// Statistics of the compared episodes, which show that the comparison is not vacuous.
struct Seen {
  int steps = 0;
  double largest_turn = 0;  // [rad]
  double furthest = 0;      // [m]
  double fastest = 0;       // torso [m/s]
};

/// End of the positions and velocities in the observation, which the lidar may follow.
const double* state_end(const Observer& observer) {
  const RangeFinder& finder = observer.walker.environment->specification().range_finder;
  const std::vector<double>& all = observer.walker.observation;
  return all.data() + all.size() - (finder.is_observed ? finder.num_rays : 0);
}

void expect_equal(const Observer& observer) {
  const auto state =
      static_cast<std::size_t>(state_end(observer) - observer.walker.observation.data());
  for (std::size_t i = 0; i < observer.built.size(); ++i) {
    ASSERT_NEAR(observer.built[i], observer.walker.observation[i], i < state ? kBound : kRangeBound)
        << "value " << i;
  }
}

void watch(const Observer& observer, Seen& seen) {
  // Indexed from the end of the state, because x may come first.
  const double pitch = state_end(observer)[-16];
  const Vector3& velocity = observer.measurements.linear_velocity;
  ++seen.steps;
  seen.largest_turn = std::max(seen.largest_turn, std::abs(pitch));
  seen.furthest = std::max(seen.furthest, observer.measurements.position[0]);
  seen.fastest = std::max(seen.fastest, std::hypot(velocity[0], velocity[2]));
}

void expect_equal_observations(Observer& observer, const std::string& kind, std::uint64_t seeds,
                               Seen& seen) {
  const std::unique_ptr<Agent> heuristic =
      make_agent("heuristic", make("Walker2d-v5")->specification(), 0);
  for (std::uint64_t seed = 0; seed < seeds; ++seed) {
    Actions actions(kind == "heuristic" ? "zero" : kind, seed);
    std::vector<double> action(kJointCount);
    observer.reset(seed);
    SCOPED_TRACE(kind + ", seed " + std::to_string(seed));
    ASSERT_NO_FATAL_FAILURE(expect_equal(observer));
    while (!observer.walker.has_ended()) {
      actions.draw(observer.walker.observation, action);
      // The gait expects observations without x.
      const double* const end = state_end(observer);
      if (kind == "heuristic") action = heuristic->act({end - 17, end});
      observer.step(action);
      watch(observer, seen);
      ASSERT_NO_FATAL_FAILURE(expect_equal(observer)) << seen.steps << " steps in all";
    }
  }
}

struct Case {
  std::string id;
  bool exclude_positions;
  bool include_lidar = false;
};

class ObservationBuilderTest : public testing::TestWithParam<Case> {
 protected:
  static Parameters parameters() {
    return {{"exclude_current_positions_from_observation", GetParam().exclude_positions},
            {"include_lidar_in_observation", GetParam().include_lidar}};
  }
};

TEST_P(ObservationBuilderTest, EqualsTheEnvironmentsObservation) {
  Observer observer(GetParam().id, parameters());
  Seen seen;
  for (const char* kind : {"random", "heuristic", "balance", "smooth", "saturated"}) {
    expect_equal_observations(observer, kind, 5, seen);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(seen.steps, 3000);
  EXPECT_GT(seen.furthest, 10) << "nobody walked";
}

TEST_P(ObservationBuilderTest, FollowsSomersaultsAndClippedVelocities) {
  Parameters lively = parameters();
  lively["terminate_when_unhealthy"] = false;
  lively["reset_noise_scale"] = 3.0;  // angles up to almost half a turn
  Observer observer(GetParam().id, lively);
  Seen seen;
  for (const char* kind : {"random", "saturated", "smooth"}) {
    expect_equal_observations(observer, kind, 6, seen);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(seen.largest_turn, 2 * M_PI) << "no somersault";
  EXPECT_GT(seen.fastest, 10) << "nothing to clip";
}

INSTANTIATE_TEST_SUITE_P(Ids, ObservationBuilderTest,
                         testing::Values(Case{"Walker2d-v4", true}, Case{"Walker2d-v4", false},
                                         Case{"Walker2d-v5", true}, Case{"Walker2d-v5", false},
                                         Case{"Walker2d-v4", false, true},
                                         Case{"Walker2d-v5", true, true}),
                         [](const testing::TestParamInfo<Case>& of) {
                           return of.param.id.substr(9) +
                                  (of.param.exclude_positions ? "" : "_with_x") +
                                  (of.param.include_lidar ? "_with_lidar" : "");
                         });

/// The coordinates of the root joints do not start at the world's origin, and the actuators and
/// joints have different orders.
TEST(OtherModels, MayHaveShiftedRootJoints) {
  std::string text = other_walker_text();
  text = replaced(text, "name=\"x\" type=\"slide\"", "name=\"x\" type=\"slide\" ref=\"-3\"");
  text = replaced(text, "name=\"pitch\" type=\"hinge\"", "name=\"pitch\" type=\"hinge\" ref=\"4\"");
  // Axes that equal the world's except for rounding.
  text = replaced(text, "0.9800665778412416 0 0.19866933079506122", "0.98 0 0.1987");
  text = replaced(text, "-0.19866933079506122 0 0.9800665778412416", "-0.1986 0 0.9801");
  const Folder folder;
  Observer observer("Walker2d-v5", {{"xml_file", folder.write("other.xml", text)},
                                    {"exclude_current_positions_from_observation", false},
                                    {"include_lidar_in_observation", true},
                                    {"terminate_when_unhealthy", false}});
  Seen seen;
  for (const char* kind : {"random", "saturated", "smooth"}) {
    expect_equal_observations(observer, kind, 4, seen);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(seen.steps, 10000);
  observer.reset(0);
  EXPECT_NEAR(observer.built[0], -3, 0.1);
  EXPECT_NEAR(observer.built[1], 1.1, 0.1);
  EXPECT_NEAR(observer.built[2], 4, 0.1);
}

class MeasurementsTest : public ChangedMeasurements {
 protected:
  MeasurementsTest()
      : ChangedMeasurements("Walker2d-v4", {{"exclude_current_positions_from_observation", false},
                                            {"include_lidar_in_observation", true}}) {}

  void SetUp() override {
    observer_.reset(1);
    for (int i = 0; i < 15; ++i) observer_.step({0.4, -0.2, 0.1, 0.3, -0.5, 0.2});
    measurements_ = observer_.measurements;
  }
};

/// bipedal_walker/observation_builder_test.cpp has what both robots refuse.
TEST_F(MeasurementsTest, RejectsWrongMeasurements) {
  using M = Measurements;
  const std::pair<std::function<void(M&)>, const char*> cases[] = {
      {[](M& m) { m.position[0] = kNaN; }, "position[0] = nan m; must be finite"},
      {[](M& m) { m.position[2] = kNaN; }, "position[2] = nan m; must be finite"},
      {[](M& m) { m.joint_position[3] = kNaN; },
       "joint_position[3] (thigh_left_joint) = nan rad; must be finite"},
  };
  for (const auto& [change, message] : cases) EXPECT_EQ(refusal(change), message);
}

/// A scan is not needed for an observation without ranges.
TEST(Ranges, AreIgnoredUnlessObserved) {
  Observer observer("Hopper-v5");
  observer.reset(2);
  observer.measurements.ranges.clear();
  std::vector<double> built(observer.built.size());
  observer.builder->build(observer.measurements, built.data());
  EXPECT_EQ(built, observer.built);
}

}  // namespace
}  // namespace walker::mujoco
