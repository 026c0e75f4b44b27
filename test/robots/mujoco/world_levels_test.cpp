// Walkers in levels: stable everywhere, their health measured from the ground.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "as_numbers.h"
#include "observer.h"
#include "robots/mujoco/random_level.h"
#include "robots/mujoco/world_robot.h"
#include "test_steps.h"

namespace walker::mujoco {
namespace {

class WorldLevelsTest : public RobotTest {};

/// Returns the height of the upper side of ground and obstacles at x.
double height_in(const Scene& scene, double x) {
  double height = -1e9;
  const auto see = [&](const std::array<double, 2>& from, const std::array<double, 2>& to) {
    if (from[0] > x || to[0] < x || from[0] == to[0]) return;
    height = std::max(height, from[1] + (x - from[0]) / (to[0] - from[0]) * (to[1] - from[1]));
  };
  for (const ScenePolygon& ground : scene.ground) see(ground.points[0], ground.points[1]);
  for (const ScenePolygon& box : scene.obstacles) see(box.points[3], box.points[2]);
  return height;
}

/// Random actions from all along the ground, in levels at each parameter's limits and between.
TEST_P(WorldLevelsTest, IsStableInLevels) {
  Generator random(7);
  std::vector<WorldValues> levels;
  for (const WorldParameter& parameter : level_parameters()) {
    for (const double value : {parameter.minimum, parameter.maximum}) {
      levels.push_back({{parameter.name, value}});
      if (parameter.name == "obstacle_spacing") {
        levels.back()["stump_height"] = 0.2;
        levels.push_back({{parameter.name, value}, {"pit_gap", 0.5}});
      }
    }
  }
  for (int i = 0; i < 40; ++i) levels.push_back(random_level(random));
  WorldRobot robot = make();
  Numbers action(robot.action_size());
  const std::uint64_t num_seeds = num_test_steps(25000) / (100 * levels.size()) + 1;
  for (const WorldValues& level : levels) {
    SCOPED_TRACE(to_string(as_numbers(level)));
    robot.robot->set_world(level);
    for (std::uint64_t seed = 0; seed < num_seeds; ++seed) {
      robot.reset(seed);
      Scene scene;
      robot.robot->scene(scene);
      for (int i = 0; i < 100; ++i) {
        if (i % 50 == 25 && level_of(level)) {
          Numbers place(kBaseJoints + robot.action_size());
          place[kBaseX] = random.uniform(0, 100);
          place[kBaseZ] = 1.3 + height_in(scene, place[kBaseX]);
          robot.place(place);
        }
        for (double& value : action) value = random.uniform(-1, 1);
        ASSERT_NO_THROW(robot.step(action, {random.uniform(-5, 10), random.uniform(-5, 10)}));
        for (const double value : robot.observation()) ASSERT_TRUE(std::isfinite(value));
      }
    }
  }
}

/// A walker over a pit falls until its torso is too low above the rims.
TEST_P(WorldLevelsTest, APitEndsTheEpisode) {
  const KernelVariable variable(std::get<1>(GetParam()));
  WorldRobot robot(id(), {{"exclude_current_positions_from_observation", false}}, {{"pit_gap", 2}});
  WorldRobot endless = make({{"pit_gap", 2}});
  const bool is_hopper = std::string(id()).find("Hopper") == 0;
  const double limit = is_hopper ? 0.7 : 0.8;
  for (WorldRobot* each : {&robot, &endless}) {
    each->reset(1);
    Numbers over(kBaseJoints + each->action_size());
    over[kBaseX] = 3.2;
    over[kBaseZ] = 1.25;
    each->place(over);
  }
  for (int i = 0; i < 100 && !robot.result.terminated; ++i) {
    EXPECT_GT(robot.observation()[kBaseZ], limit);
    robot.step(idle(robot));
  }
  ASSERT_TRUE(robot.result.terminated);
  EXPECT_EQ(robot.result.end_reason, std::string("the torso's height left healthy_z_range"));
  EXPECT_LT(robot.observation()[kBaseZ], limit);
  for (int i = 0; i < 300; ++i) endless.step(idle(endless));
  EXPECT_GT(endless.observation()[kBaseZ], -0.9) << "a pit has a bottom";
  EXPECT_LT(endless.observation()[kBaseZ], 0.4);
}

/// Health is measured from the ground below: a tread far up or down is healthy ground.
TEST_P(WorldLevelsTest, HealthIsMeasuredFromTheGround) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    WorldRobot robot = make({{"stair_height", 0.5}, {"stair_steps", 9}, {"stair_width", 1}});
    robot.reset(seed);
    Scene scene;
    robot.robot->scene(scene);
    for (double x = 2.5; x < 60; x += 1.73) {
      const double height = height_in(scene, x);
      Numbers place(kBaseJoints + robot.action_size());
      place[kBaseX] = x;
      place[kBaseZ] = height + 1.25;
      robot.place(place);
      EXPECT_EQ(robot.robot->is_healthy(), true) << x << " " << height;
      place[kBaseZ] = height + 0.65;
      robot.place(place);
      EXPECT_EQ(robot.robot->is_healthy(), false);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, WorldLevelsTest, testing::ValuesIn(kRobots), name_of);

}  // namespace
}  // namespace walker::mujoco
