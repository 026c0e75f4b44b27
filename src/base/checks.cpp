#include "base/checks.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "base/shortest_text.h"
#include "walker_sim/errors.h"

namespace walker {
namespace {

bool is_finite(double value) { return std::isfinite(value); }

std::string element(const std::string& name, std::size_t index) {
  return name + "[" + std::to_string(index) + "]";
}

void check_size(const std::string& name, std::size_t size, std::size_t right,
                const std::string& what) {
  if (size == right) return;
  throw std::invalid_argument(name + " has " + std::to_string(size) + " values; must have " +
                              std::to_string(right) + ", one per " + what);
}

void check_joints(const std::string& name, const double* values, std::size_t size,
                  const std::string& unit, const Specification& specification) {
  check_size(name, size, specification.joints.size(), "joint");
  for (std::size_t i = 0; i < size; ++i) {
    check_finite(element(name, i) + " (" + specification.joints[i].name + ")", values[i], unit);
  }
}

void check_orientation(const Quaternion& q) {
  constexpr double kTolerance = 1e-3;  // of the norm: accepts quaternions in single precision
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (std::abs(norm - 1) <= kTolerance) return;
  std::string text;
  for (const double value : q) text += (text.empty() ? "" : ", ") + fixed_text(value);
  throw std::invalid_argument("orientation = (" + text + "); must be a unit quaternion");
}

}  // namespace

void check_action(const Specification& specification, const double* action, std::size_t size,
                  const char* what, const char* unit) {
  // A valid action builds no message strings.
  if (size == specification.joints.size() && std::all_of(action, action + size, is_finite)) return;
  try {
    check_joints(what, action, size, unit, specification);
  } catch (const std::invalid_argument& error) {
    throw InvalidAction(error.what());
  }
}

void check_action_of(std::size_t environment, const Specification& specification,
                     const double* action) {
  const std::size_t size = specification.action_size();
  if (std::all_of(action, action + size, is_finite)) return;
  const std::string what = "environment " + std::to_string(environment) + ": action";
  check_action(specification, action, size, what.c_str());
}

void check_actions_size(const Specification& specification, std::size_t size,
                        std::size_t num_envs) {
  const std::size_t action_size = specification.action_size();
  if (size == num_envs * action_size) return;
  throw InvalidAction("actions have " + std::to_string(size) + " values; must have " +
                      std::to_string(num_envs * action_size) + ", " + std::to_string(action_size) +
                      " for each of " + std::to_string(num_envs) + " environments");
}

void check_coordinates(const Specification& specification, const std::vector<double>& position,
                       const std::vector<double>& velocity) {
  const std::size_t num_coordinates = specification.num_coordinates;
  if (num_coordinates == 0) {
    throw std::logic_error(specification.id +
                           " has no positions and velocities that can be set; load a saved state");
  }
  for (const auto& [name, values] : {std::pair("qpos", &position), std::pair("qvel", &velocity)}) {
    check_size(name, values->size(), num_coordinates, "coordinate");
    for (std::size_t i = 0; i < values->size(); ++i) {
      check_finite(element(name, i), (*values)[i], "");
    }
  }
}

void check_finite(const std::string& name, double value, const std::string& unit) {
  if (std::isfinite(value)) return;
  throw std::invalid_argument(name + " = " + fixed_text(value) + unit + "; must be finite");
}

void check_measurements(const Measurements& measurements, const Specification& specification) {
  const std::vector<double>& position = measurements.joint_position;
  const std::vector<double>& velocity = measurements.joint_velocity;
  check_joints("joint_position", position.data(), position.size(), " rad", specification);
  check_joints("joint_velocity", velocity.data(), velocity.size(), " rad/s", specification);
  check_orientation(measurements.orientation);
  for (std::size_t k = 0; k < 3; ++k) {
    check_finite(element("angular_velocity", k), measurements.angular_velocity[k], " rad/s");
    check_finite(element("linear_velocity", k), measurements.linear_velocity[k], " m/s");
  }
  check_size("contacts", measurements.contacts.size(), specification.contact_links.size(),
             "contact link");
  if (!specification.range_finder.is_observed) return;
  check_size("ranges", measurements.ranges.size(), specification.range_finder.num_rays, "ray");
  for (std::size_t i = 0; i < measurements.ranges.size(); ++i) {
    const double range = measurements.ranges[i];
    if (range >= 0) continue;
    throw std::invalid_argument(element("ranges", i) + " = " + fixed_text(range) +
                                " m; must be at least 0, or +infinity where the ray met nothing");
  }
  const double reach = measurements.maximum_range;
  if (std::isfinite(reach) && reach >= 0) return;
  throw std::invalid_argument("maximum_range = " + fixed_text(reach) +
                              " m; must be finite and at least 0");
}

void check_number(const std::string& name, std::size_t value, std::size_t lowest,
                  std::size_t highest) {
  if (value >= lowest && value <= highest) return;
  throw std::invalid_argument(name + " = " + std::to_string(value) + ": must be in [" +
                              std::to_string(lowest) + ", " + std::to_string(highest) + "]");
}

}  // namespace walker
