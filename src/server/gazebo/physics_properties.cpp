#include "server/gazebo/physics_properties.h"

#include <cmath>
#include <exception>
#include <stdexcept>

#include "base/shortest_text.h"
#include "server/schedule/schedule.h"

namespace walker::gazebo {
namespace {

/// Equality up to rounding: clients write 0.006 where the engine adds 0.002 three times.
bool is_same(double one, double other) {
  constexpr double kRounding = 1e-9;
  return std::abs(one - other) <= kRounding * std::abs(other);
}

std::string text(const Vector3& vector) {
  return "[" + shortest_text(vector[0]) + ", " + shortest_text(vector[1]) + ", " +
         shortest_text(vector[2]) + "]";
}

bool is_same(const Vector3& one, const Vector3& other) {
  return is_same(one[0], other[0]) && is_same(one[1], other[1]) && is_same(one[2], other[2]);
}

/// @throws std::invalid_argument if step or gravity differ from the environment's
void check_environment(const SetPhysicsProperties::Request& request,
                       const Specification& specification) {
  std::string faults;
  if (!is_same(request.time_step, specification.dt)) {
    faults = "time_step = " + shortest_text(request.time_step) + " s; must be " +
             shortest_text(specification.dt) + ", a step of " + specification.id;
  }
  const Vector3 gravity{request.gravity.x, request.gravity.y, request.gravity.z};
  if (!is_same(gravity, specification.gravity)) {
    if (!faults.empty()) faults += "; ";
    faults += "gravity = " + text(gravity) + " m/s^2; must be " + text(specification.gravity) +
              ", that of " + specification.id;
  }
  if (!faults.empty()) throw std::invalid_argument(faults);
}

std::string ode_is_ignored(const Specification& specification) {
  return "ode_config is ignored: the engine is " + specification.engine + ", not ODE";
}

}  // namespace

void get_physics_properties(const Specification& specification, const Schedule& schedule,
                            GetPhysicsProperties::Response& response) {
  response.time_step = specification.dt;
  response.pause = schedule.stands_still() ? 1 : 0;
  response.max_update_rate = schedule.real_time_factor().value_or(0) / specification.dt;
  response.gravity.x = specification.gravity[0];
  response.gravity.y = specification.gravity[1];
  response.gravity.z = specification.gravity[2];
  response.status_message = ode_is_ignored(specification);
}

void set_physics_properties(const SetPhysicsProperties::Request& request,
                            const Specification& specification, Schedule& schedule,
                            SetPhysicsProperties::Response& response) {
  check_environment(request, specification);
  const double factor = request.max_update_rate * specification.dt;
  if (!is_same(factor, schedule.real_time_factor().value_or(0))) {
    try {
      schedule.set_real_time_factor(factor);
    } catch (const std::exception& error) {
      throw std::invalid_argument("max_update_rate = " + shortest_text(request.max_update_rate) +
                                  " Hz with steps of " + shortest_text(specification.dt) +
                                  " s: " + error.what());
    }
  }
  response.status_message = ode_is_ignored(specification);
}

}  // namespace walker::gazebo
