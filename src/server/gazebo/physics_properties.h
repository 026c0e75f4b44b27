// What Gazebo's physics properties are here.
#pragma once

#include "server/drive/drive.h"
#include "server/gazebo/physics_messages.h"
#include "walker_sim/specification.h"

namespace walker::gazebo {

/// Tells step, pace, pause and gravity. What it tells, `set_physics_properties` takes.
void get_physics_properties(const Specification& specification, const Drive& drive,
                            GetPhysicsProperties::Response& response);

/// Sets the pace. Step and gravity are the environment's: others are refused, for they would be
/// another environment under the same id. Settings of ODE are ignored, and the answer says so.
/// @throws std::exception that names what cannot be set, its value and what is allowed; then
///         nothing has changed
void set_physics_properties(const SetPhysicsProperties::Request& request,
                            const Specification& specification, Drive& drive,
                            SetPhysicsProperties::Response& response);

}  // namespace walker::gazebo
