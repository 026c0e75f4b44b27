// Computes the environment's observation from a robot's sensor measurements.
#pragma once

#include <cstdint>
#include <vector>

#include "walker_sim/export.h"
#include "walker_sim/specification.h"

namespace walker {

/// A robot's sensor measurements at one instant, in the axes and units of the ROS messages that
/// carry them (REP 103, 117, 145). They suffice to compute a trained policy's observation.
struct Measurements {
  std::vector<double> joint_position;    ///< joints in action order [rad]
  std::vector<double> joint_velocity;    ///< [rad/s]
  Quaternion orientation{{0, 0, 0, 1}};  ///< trunk in the world frame; from imu
  Vector3 angular_velocity{};            ///< trunk, in its own axes [rad/s]; from imu
  Vector3 position{};                    ///< trunk's origin in the world frame [m]; from odom
  Vector3 linear_velocity{};  ///< trunk's origin, in the trunk's axes [m/s]; from odom's twist
  std::vector<std::uint8_t> contacts;  ///< per contact link; 1: touches the ground
  std::vector<double> ranges;          ///< of the range finder [m]; +infinity: no hit; unused
                                       ///< unless the observation contains them
  double maximum_range = 0;            ///< of the range finder [m]; from scan
};

/// Builds the observations of one environment. Not thread-safe.
///
/// From a simulated walker's measurements it reproduces the environment's observation up to
/// rounding: each value within 1.2e-7 (2^-23, single precision) for BipedalWalker and for ranges,
/// which a scan has in single precision, and within 1e-12 for the rest of Walker2d and Hopper.
/// Tests check these bounds.
class WALKER_SIM_EXPORT ObservationBuilder {
 public:
  ObservationBuilder() = default;
  ObservationBuilder(const ObservationBuilder&) = delete;
  ObservationBuilder& operator=(const ObservationBuilder&) = delete;
  virtual ~ObservationBuilder() = default;

  /// Begins an episode. The trunk's pitch is assumed to be within half a turn of the walker's start
  /// pose. From then on the pitch is unwrapped, as engines count whole turns and orientations do
  /// not; so the trunk must turn by less than half a turn between two calls of `build`.
  virtual void reset() = 0;

  /// @param observation caller's buffer, the environment's `observation_size()` values
  /// @throws std::invalid_argument naming the measurement, its value and the allowed values if a
  ///         size is wrong or a value that the observation needs is invalid; `observation` is then
  ///         unchanged
  virtual void build(const Measurements& measurements, double* observation) = 0;
};

}  // namespace walker
