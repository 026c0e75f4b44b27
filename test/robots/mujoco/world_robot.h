// A robot with buffers, for tests of what an episode draws for it, and their fixture.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "base/random.h"
#include "kernel_variable.h"
#include "robots/mujoco/planar_model.h"
#include "robots/robot.h"
#include "test_name.h"
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

using Numbers = std::vector<double>;

/// A robot that shows all of its state, stepped by the kernel of this name.
inline WorldRobot make_robot(const char* kernel, const std::string& id,
                             const WorldValues& world = {}, Parameters parameters = {}) {
  const KernelVariable variable(kernel);
  parameters["exclude_current_positions_from_observation"] = false;
  parameters["include_lidar_in_observation"] = true;
  parameters["terminate_when_unhealthy"] = false;
  return WorldRobot(id, parameters, world);
}

/// Bent joints in the air, away from limits and contacts.
inline Numbers flying(const WorldRobot& robot) {
  Numbers position(kBaseJoints + robot.action_size(), -0.3);
  position[kBaseX] = 0.1;
  position[kBaseZ] = 20;
  position[kBasePitch] = 0.2;
  return position;
}

inline Numbers idle(const WorldRobot& robot) { return Numbers(robot.action_size()); }

/// Parameters: an id, and the kernel that steps it (null: the fastest).
class RobotTest : public testing::TestWithParam<std::tuple<const char*, const char*>> {
 protected:
  static const char* id() { return std::get<0>(GetParam()); }

  static WorldRobot make(const WorldValues& world = {}, const Parameters& parameters = {}) {
    return make_robot(std::get<1>(GetParam()), id(), world, parameters);
  }
};

constexpr std::tuple<const char*, const char*> kRobots[] = {
    {"Walker2d-v4", nullptr}, {"Walker2d-v4", "sse2"}, {"Walker2d-v4", "off"},
    {"Walker2d-v5", nullptr}, {"Walker2d-v5", "sse2"}, {"Walker2d-v5", "off"},
    {"Hopper-v4", nullptr},   {"Hopper-v5", nullptr}};

inline std::string name_of(const testing::TestParamInfo<RobotTest::ParamType>& info) {
  const auto [id, kernel] = info.param;
  return test_name(id) + (kernel == nullptr ? "" : std::string("_") + kernel);
}

}  // namespace walker::mujoco
