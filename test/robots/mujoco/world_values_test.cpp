// Physics of worlds: gravity, masses, strength, at their limits and at Gymnasium's values.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "base/link_parameters.h"
#include "bits.h"
#include "observer.h"
#include "robots/mujoco/level_ground.h"
#include "robots/mujoco/player.h"
#include "robots/mujoco/world_robot.h"

namespace walker::mujoco {
namespace {

class WorldValuesTest : public RobotTest {};

constexpr double kGravity = -9.81;

double velocity_of(const WorldRobot& robot, int dof) {
  return robot.observation()[kBaseJoints + robot.action_size() + dof];
}

Numbers row(const WorldRobot& robot) {
  Numbers numbers = robot.observation();
  numbers.push_back(robot.result.reward);
  numbers.insert(numbers.end(), robot.info.begin(), robot.info.end());
  return numbers;
}

TEST_P(WorldValuesTest, FallsFreelyUnderTheWorldsGravity) {
  for (const double gravity : {kGravity, 0.0, -1.62, -50.0}) {
    WorldRobot robot = make({{"gravity", gravity}});
    robot.reset(0);
    robot.place(flying(robot));
    for (int i = 0; i < 10; ++i) {
      const double before = velocity_of(robot, kBaseZ);
      robot.step(idle(robot));
      const double expected = gravity * robot.robot->specification().dt;
      // The observed velocity is limited to 10 m/s, and its rounding grows with it.
      if (before + expected < -10) break;
      EXPECT_NEAR(velocity_of(robot, kBaseZ) - before, expected, 1e-12 * (1 - gravity)) << i;
      EXPECT_NEAR(velocity_of(robot, kBaseX), 0, 1e-12);
      EXPECT_NEAR(velocity_of(robot, kBasePitch), 0, 1e-12);
    }
    Sensors sensors;
    robot.robot->sense(sensors);
    EXPECT_EQ(sensors.gravity, (Vector3{0, 0, gravity}));
    EXPECT_EQ(robot.robot->specification().gravity, (Vector3{0, 0, kGravity}));
  }
}

/// Values that are Gymnasium's change no bit, and another world leaves nothing behind.
TEST_P(WorldValuesTest, GymnasiumsValuesGiveGymnasiumsBits) {
  WorldValues defaults;
  for (const WorldParameter& parameter : find_registration(id()).world_parameters) {
    if (!std::isnan(parameter.default_value)) defaults[parameter.name] = parameter.default_value;
  }
  WorldRobot plain = make();
  WorldRobot named = make(defaults);
  WorldRobot former = make({{"gravity", -3}, {"mass_scale", 2}, {"joint_damping", 5}});
  WorldRobot climber = make({{"ground_roughness", 3}, {"stair_height", 0.2}});
  for (WorldRobot* robot : {&former, &climber}) {
    robot->reset(1);
    robot->step(idle(*robot), {5, 5});
    robot->robot->set_world({});
  }
  Actions actions("random", 1, static_cast<int>(plain.action_size()));
  Numbers action;
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    for (WorldRobot* robot : {&plain, &named, &former, &climber}) robot->reset(seed);
    for (int i = 0; i < 60; ++i) {
      actions.draw(plain.observation(), action);
      for (WorldRobot* robot : {&plain, &named, &former, &climber}) robot->step(action);
      ASSERT_EQ(to_bits(row(climber)), to_bits(row(plain)));
      ASSERT_EQ(to_bits(row(named)), to_bits(row(plain)));
      ASSERT_EQ(to_bits(row(former)), to_bits(row(plain)));
    }
  }
}

/// The limits of the physics and those of the floor and the masses, all combinations of each, from
/// wild starts. Motors of ten times the strength are too strong for bodies of a tenth of a
/// kilogram.
TEST_P(WorldValuesTest, IsStableAtTheLimits) {
  std::vector<WorldParameter> all = find_registration(id()).world_parameters;
  // Forces are the episode's, and would make a thousand times as many corners.
  const auto is_force = [](const WorldParameter& each) { return is_force_name(each.name); };
  all.erase(std::remove_if(all.begin(), all.end(), is_force), all.end());
  const auto place = [&all](const char* name) {
    return std::find_if(all.begin(), all.end(),
                        [name](const WorldParameter& each) { return each.name == name; });
  };
  std::vector<WorldValues> worlds;
  const auto add_corners = [&worlds](auto begin, auto end) {
    for (unsigned corner = 0; corner < 1U << (end - begin); ++corner) {
      WorldValues& world = worlds.emplace_back();
      for (auto each = begin; each != end; ++each) {
        const bool is_most = (corner >> (each - begin) & 1U) != 0;
        world[each->name] = is_most ? each->maximum : each->minimum;
      }
    }
  };
  add_corners(place("gravity"), place("floor_friction"));
  add_corners(place("floor_friction"), place("lidar_range"));
  for (std::size_t corner = 0; corner < worlds.size(); ++corner) {
    WorldRobot robot = make(worlds[corner], {{"reset_noise_scale", 0.1}});
    Actions actions("saturated", corner, static_cast<int>(robot.action_size()));
    Numbers action;
    for (std::uint64_t seed = 0; seed < 2; ++seed) {
      robot.reset(seed);
      for (int i = 0; i < 100; ++i) {
        actions.draw(robot.observation(), action);
        ASSERT_NO_THROW(robot.step(action)) << "corner " << corner;
        for (const double value : robot.observation()) {
          ASSERT_TRUE(std::isfinite(value)) << "corner " << corner;
        }
      }
    }
  }
}

/// The sensors' effort is the motor's, with its strength.
TEST(MotorStrengthTest, ScalesTheEffort) {
  for (const auto& [id, effort] : {std::pair("Walker2d-v4", 100.0), {"Hopper-v4", 200.0}}) {
    WorldRobot robot = make_robot(nullptr, id, {{"motor_strength", 0.3}});
    robot.reset(0);
    robot.step(Numbers(robot.action_size(), 0.5));
    Sensors sensors;
    robot.robot->sense(sensors);
    for (const double value : sensors.joint_effort) EXPECT_NEAR(value, 0.15 * effort, 1e-12);
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, WorldValuesTest, testing::ValuesIn(kRobots), name_of);

}  // namespace
}  // namespace walker::mujoco
