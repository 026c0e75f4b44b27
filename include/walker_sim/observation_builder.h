// The environment's observation out of what a robot's sensors measure.
#pragma once

#include <cstdint>
#include <vector>

#include "walker_sim/export.h"
#include "walker_sim/specification.h"

namespace walker {

/// What a robot's sensors tell of one instant, in the axes and units of the ROS messages that carry
/// it (REP 103, 117, 145). A policy needs nothing else to see what it saw in training.
struct Measurements {
  std::vector<double> joint_position;    ///< joints in action order [rad]
  std::vector<double> joint_velocity;    ///< [rad/s]
  Quaternion orientation{{0, 0, 0, 1}};  ///< of the trunk in the world; imu
  Vector3 angular_velocity{};            ///< of the trunk, in its own axes [rad/s]; imu
  Vector3 position{};                    ///< of the trunk's origin in the world [m]; odom
  Vector3 linear_velocity{};  ///< of the trunk's origin, in the trunk's axes [m/s]; odom's twist
  std::vector<std::uint8_t> contacts;  ///< per contact link: 1 touches the ground
  std::vector<double> ranges;          ///< of the range finder [m]; +infinity: the ray met nothing
};

/// Makes observations of one environment. Not thread-safe.
///
/// Of a simulated walker's measurements it makes the environment's own observation but for
/// rounding: each value of BipedalWalker's within 1.2e-7 (2^-23, single precision), each of
/// Walker2d's within 1e-12. Tests hold it to that.
class WALKER_SIM_EXPORT ObservationBuilder {
 public:
  ObservationBuilder() = default;
  ObservationBuilder(const ObservationBuilder&) = delete;
  ObservationBuilder& operator=(const ObservationBuilder&) = delete;
  virtual ~ObservationBuilder() = default;

  /// An episode begins: the trunk's pitch is taken to be within half a turn of where the walker
  /// starts. From then on whole turns are counted, as engines do and orientations do not; so the
  /// trunk may turn by less than half a turn from one call of `build` to the next.
  virtual void reset() = 0;

  /// @param observation caller's, as many values as the environment's observations have
  /// @throws std::invalid_argument naming the measurement, its value and what is allowed where a
  ///         size is wrong or a number that the observation needs is no number; then `observation`
  ///         is untouched
  virtual void build(const Measurements& measurements, double* observation) = 0;
};

}  // namespace walker
