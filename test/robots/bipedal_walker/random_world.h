// Random worlds, and robots in them.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "as_numbers.h"
#include "base/link_parameters.h"
#include "base/random.h"
#include "robots/bipedal_walker/observation.h"
#include "robots/bipedal_walker/player.h"
#include "robots/bipedal_walker/world_settings.h"
#include "robots/robot.h"
#include "test_steps.h"
#include "walker_sim/parameters.h"
#include "walker_sim/registry.h"

namespace walker::bipedal_walker {

inline std::vector<double> draw_action(Generator& random) {
  std::vector<double> action(kJointCount);
  for (double& value : action) value = random.uniform(-1, 1);
  return action;
}

/// Whether a robot takes the parameter. Forces are the episode's; a constant one accelerates a
/// light walker without friction for as long as it acts.
inline bool is_robots(const WorldParameter& parameter) { return !is_force_name(parameter.name); }

/// Draws values within the limits of a third of the robot's parameters.
inline WorldValues random_values(Generator& generator, bool hardcore = false) {
  for (;;) {
    WorldValues values;
    for (const WorldParameter& parameter : world_parameters(hardcore)) {
      if (!is_robots(parameter) || generator.integers(0, 3) != 0) continue;
      const double value = generator.uniform(parameter.minimum, parameter.maximum);
      values[parameter.name] = parameter.is_whole ? std::round(value) : value;
    }
    try {
      check_world(as_numbers(values), hardcore);
      return values;
    } catch (const std::invalid_argument&) {  // a contradiction
    }
  }
}

inline std::unique_ptr<Robot> make_robot(const std::string& id, const Parameters& given = {}) {
  return find_registration(id).create(id, complete_parameters(parameter_descriptions(id), given));
}

/// A robot with its generator and the results of its last reset or step.
struct Player {
  explicit Player(const WorldValues& values, std::uint64_t seed, const std::string& id = kPlain)
      : robot(make_robot(id)), generator(seed) {
    robot->set_world(values);
    reset();
  }

  void reset() {
    robot->reset(generator, nullptr);
    observe();
  }

  /// @param push forward, up [N s]
  void step(const std::vector<double>& action, const std::array<double, 2>& push = {}) {
    result = {};
    result.robot = robot.get();
    result.action = action.data();
    result.push = push;
    robot->step(result);
    observe();
  }

  void observe() {
    observation.resize(robot->specification().observation_size());
    robot->observe(observation.data());
    robot->sense(sensors);
  }

  std::unique_ptr<Robot> robot;
  Generator generator;
  RobotStep result;
  std::vector<double> observation;
  Sensors sensors;
};

}  // namespace walker::bipedal_walker
