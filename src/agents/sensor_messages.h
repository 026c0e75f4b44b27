// Conversion of sensor messages to measurements, the inverse of src/server/topics/converters.h.
// Each function sets the fields that its topic carries, in the order of the specification.
#pragma once

#include <nav_msgs/Odometry.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/LaserScan.h>

#include "walker_sim/Contacts.h"
#include "walker_sim/observation_builder.h"
#include "walker_sim/specification.h"

namespace walker {

/// Accepts joints in any order and ignores unknown ones.
/// @throws std::invalid_argument naming a joint that is missing or has no position or velocity
void take(const sensor_msgs::JointState& message, const Specification& specification,
          Measurements& measurements);

/// @throws std::invalid_argument if the covariances say, by REP 145, that the orientation or the
///         angular velocity is not measured
void take(const sensor_msgs::Imu& message, const Specification& specification,
          Measurements& measurements);

void take(const nav_msgs::Odometry& message, const Specification& specification,
          Measurements& measurements);

/// Accepts links in any order and ignores unknown ones.
/// @throws std::invalid_argument naming a link that is missing
void take(const walker_sim::Contacts& message, const Specification& specification,
          Measurements& measurements);

/// @throws std::invalid_argument if the directions of the rays differ from the range finder's
void take(const sensor_msgs::LaserScan& message, const Specification& specification,
          Measurements& measurements);

}  // namespace walker
