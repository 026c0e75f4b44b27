// The engine is stable at the ends of every parameter's range, with random actions.
// WALKER_SIM_TEST_STEPS sets the number of steps per end.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "as_numbers.h"
#include "base/link_parameters.h"
#include "robots/bipedal_walker/random_world.h"

namespace walker::bipedal_walker {
namespace {

constexpr std::size_t kRobots = 64;

/// Box2D limits a body's turning speed to this, which unstable joints reach [rad/s].
constexpr double kEngineLimit = 157.07;

struct Outcome {
  long episodes = 0;
  double fastest_hull = 0;   ///< [m/s]
  double fastest_joint = 0;  ///< [rad/s]
};

std::vector<LinkWrench> forces_of(const WorldValues& values) {
  std::vector<LinkWrench> forces;
  for (std::uint32_t link = 0; link < kBodies; ++link) {
    forces.push_back({link, value_or(values, force_name(kLinks[link], 'x'), 0),
                      value_or(values, force_name(kLinks[link], 'z'), 0), 0});
  }
  return forces;
}

/// Plays random episodes of up to 400 steps. Every other walker is pushed through the level, also
/// after its fall.
Outcome play(const WorldValues& values) {
  const long num_steps = num_test_steps(12800);
  Outcome outcome;
  Generator random(1);
  const double mass = value_or(values, "mass_scale", 1);
  const std::vector<LinkWrench> forces = forces_of(values);
  std::vector<std::unique_ptr<Robot>> robots;
  std::vector<Generator> generators;
  for (std::size_t i = 0; i < kRobots; ++i) {
    robots.push_back(make_robot(kHardcore));
    robots.back()->set_world(values);
    generators.emplace_back(i);
  }
  std::vector<int> ages(kRobots, 400);
  std::vector<std::vector<double>> actions(kRobots);
  std::array<double, kObservationSize> observation{};
  Sensors sensors;
  std::vector<RobotStep> steps(kRobots);
  std::vector<RobotStep*> pointers;
  for (long done = 0; done < num_steps; done += kRobots) {
    pointers.clear();
    for (std::size_t i = 0; i < kRobots; ++i) {
      RobotStep& step = steps[i];
      const bool is_pushed = i % 2 != 0;
      const bool has_ended = ages[i] >= 400 || (!is_pushed && step.terminated);
      step = {};
      step.robot = robots[i].get();
      actions[i] = draw_action(random);
      step.action = actions[i].data();
      step.forces = &forces;
      if (is_pushed) step.push = {mass * random.uniform(-0.5, 1.5), mass * random.uniform(0, 1.5)};
      if (has_ended) {
        step.generator = &generators[i];
        ages[i] = 0;
        ++outcome.episodes;
      }
      ++ages[i];
      pointers.push_back(&step);
    }
    robots[0]->step_group(pointers.data(), kRobots);
    for (std::size_t i = 0; i < kRobots; ++i) {
      if (steps[i].failure) std::rethrow_exception(steps[i].failure);
      robots[i]->observe(observation.data());
      for (const double value : observation) {
        if (!std::isfinite(value)) throw std::runtime_error("an observation is not finite");
      }
      robots[i]->sense(sensors);
      outcome.fastest_hull = std::max(
          outcome.fastest_hull, std::hypot(sensors.linear_velocity[0], sensors.linear_velocity[2]));
      for (const double speed : sensors.joint_velocity) {
        outcome.fastest_joint = std::max(outcome.fastest_joint, std::abs(speed));
      }
    }
  }
  return outcome;
}

/// @param max_joint_speed [rad/s]
void expect_stable(const std::string& what, const WorldValues& values,
                   double max_joint_speed = kEngineLimit / 2) {
  Outcome outcome;
  ASSERT_NO_THROW(outcome = play(values)) << what;
  std::cout << what << ": " << outcome.episodes << " episodes, hull up to " << outcome.fastest_hull
            << " m/s, joints up to " << outcome.fastest_joint << " rad/s\n";
  EXPECT_LT(outcome.fastest_joint, max_joint_speed) << what;
}

TEST(WorldLimitsTest, EndsOfEveryRangeAreStable) {
  expect_stable("plain", {});
  for (const WorldParameter& parameter : world_parameters(true)) {
    for (const double value : {parameter.minimum, parameter.maximum}) {
      WorldValues values{{parameter.name, value}};
      if (parameter.name == "joint_damping") values["mass_scale"] = std::max(value, 0.2);
      ASSERT_NO_THROW(check_world(as_numbers(values), true));
      expect_stable(parameter.name + " = " + std::to_string(value), values);
    }
  }
  expect_stable("joint_damping = 1", {{"joint_damping", 1}});
  expect_stable("joint_damping = 1, no motors", {{"joint_damping", 1}, {"motor_strength", 0}});
}

TEST(WorldLimitsTest, RandomWorldsAreStable) {
  Generator generator(3);
  for (int i = 0; i < 20; ++i) {
    expect_stable("world " + std::to_string(i), random_values(generator, true));
  }
}

/// Each of the robot's parameters is absent, or at an end of its range. A light walker with strong,
/// fast motors without friction is wild, but not unstable.
TEST(WorldLimitsTest, CornersAreStable) {
  Generator generator(4);
  for (int i = 0; i < 20;) {
    WorldValues values;
    for (const WorldParameter& parameter : world_parameters(true)) {
      const auto choice = is_robots(parameter) ? generator.integers(0, 3) : 2;
      if (choice == 0) values[parameter.name] = parameter.minimum;
      if (choice == 1) values[parameter.name] = parameter.maximum;
    }
    try {
      check_world(as_numbers(values), true);
    } catch (const std::invalid_argument&) {
      continue;
    }
    std::string what;
    for (const auto& [name, value] : values) what += name + " " + std::to_string(value) + ", ";
    expect_stable("corner " + std::to_string(i++) + ", " + what, values, kEngineLimit);
  }
}

}  // namespace
}  // namespace walker::bipedal_walker
