// A robot with buffers, for tests of what an episode draws for it.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/random.h"
#include "robots/robot.h"
#include "walker_sim/parameters.h"
#include "walker_sim/registry.h"

namespace walker::mujoco {

struct WorldRobot {
  explicit WorldRobot(const std::string& id, const Parameters& parameters = {},
                      const WorldValues& world = {})
      : robot(find_registration(id).create(
            id, complete_parameters(parameter_descriptions(id), parameters))),
        info(robot->specification().info_names.size()) {
    robot->set_world(world);
  }

  void reset(std::uint64_t seed) {
    result = {};
    Generator generator(seed);
    robot->reset(generator, info.data());
  }

  /// Sets the state without velocities.
  void place(const std::vector<double>& position) {
    robot->set_coordinates(position, std::vector<double>(position.size()), info.data());
  }

  void step(const std::vector<double>& action, std::array<double, 2> push = {},
            const std::vector<LinkWrench>& wrenches = {}) {
    result = {};
    result.robot = robot.get();
    result.action = action.data();
    result.push = push;
    result.wrenches = wrenches;
    result.info = info.data();
    robot->step(result);
  }

  std::vector<double> observation() const {
    std::vector<double> values(robot->specification().observation_size());
    robot->observe(values.data());
    return values;
  }

  std::vector<double> observation(const SensorNoise& noise) const {
    std::vector<double> values(robot->specification().observation_size());
    robot->observe(noise, values.data());
    return values;
  }

  std::size_t action_size() const { return robot->specification().action_size(); }

  std::unique_ptr<Robot> robot;
  std::vector<double> info;
  RobotStep result;
};

}  // namespace walker::mujoco
