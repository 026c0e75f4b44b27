// Rotations and frames.
#pragma once

#include "walker_sim/specification.h"

namespace walker {

Quaternion conjugate(const Quaternion& q);
Quaternion multiply(const Quaternion& a, const Quaternion& b);

/// `v` turned by the unit quaternion `q`.
Vector3 rotate(const Quaternion& q, const Vector3& v);

Vector3 add(const Vector3& a, const Vector3& b);
Vector3 subtract(const Vector3& a, const Vector3& b);

/// `pose`, given in `base`, in the frame that `base` is given in.
Pose compose(const Pose& base, const Pose& pose);

/// `pose` seen from `base`, both given in the same frame.
Pose relative(const Pose& base, const Pose& pose);

/// Whether the pose moves nothing at all.
bool is_identity(const Pose& pose);

/// URDF's angles: turns about the fixed x, y and z axes, in this order [rad]. Where pitch is a
/// quarter turn and only a sum of roll and yaw is defined, yaw is 0.
Vector3 roll_pitch_yaw(const Quaternion& q);

}  // namespace walker
