#include "description/poses.h"

#include <cmath>

namespace walker {

// Not Eigen's eulerAngles, which turn by pi and back where an angle is negative.
Vector3 roll_pitch_yaw(const Quaternion& quaternion) {
  const Eigen::Matrix3d axes = to_eigen(quaternion).toRotationMatrix();  // the turned ones
  const double cosine = std::hypot(axes(0, 0), axes(1, 0));              // of the pitch
  const double pitch = std::atan2(-axes(2, 0), cosine);
  constexpr double kLock = 1e-12;  // below it, roll and yaw would be made of rounding errors
  if (cosine < kLock) return {std::atan2(-axes(1, 2), axes(1, 1)), pitch, 0};
  return {std::atan2(axes(2, 1), axes(2, 2)), pitch, std::atan2(axes(1, 0), axes(0, 0))};
}

}  // namespace walker
