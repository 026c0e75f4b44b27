// Gazebo's physics properties, mapped to the environment and its drive.
#pragma once

#include "server/drive/drive.h"
#include "server/gazebo/physics_messages.h"
#include "walker_sim/specification.h"

namespace walker::gazebo {

/// Returns step, pace, pause and gravity. `set_physics_properties` accepts what it returns.
void get_physics_properties(const Specification& specification, const Drive& drive,
                            GetPhysicsProperties::Response& response);

/// Sets the pace. Refuses another step or gravity, which would make another environment under the
/// same id. Ignores ODE's settings, as the response says.
/// @throws std::exception naming the field, its value and what is allowed; then nothing changes
void set_physics_properties(const SetPhysicsProperties::Request& request,
                            const Specification& specification, Drive& drive,
                            SetPhysicsProperties::Response& response);

}  // namespace walker::gazebo
