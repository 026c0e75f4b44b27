// From sensors' messages to measurements: the way back from src/server/topics/converters.h. Each
// function takes over what its topic carries, in the order of the specification.
#pragma once

#include <nav_msgs/Odometry.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/LaserScan.h>

#include "walker_sim/Contacts.h"
#include "walker_sim/observation_builder.h"
#include "walker_sim/specification.h"

namespace walker {

/// Joints in any order, among others.
/// @throws std::invalid_argument naming a joint that is missing or has no position or velocity
void take(const sensor_msgs::JointState& message, const Specification& specification,
          Measurements& measurements);

/// @throws std::invalid_argument where it says, as REP 145 has it, that it does not measure the
///         orientation or the angular velocity
void take(const sensor_msgs::Imu& message, const Specification& specification,
          Measurements& measurements);

void take(const nav_msgs::Odometry& message, const Specification& specification,
          Measurements& measurements);

/// Links in any order, among others.
/// @throws std::invalid_argument naming a link that is missing
void take(const walker_sim::Contacts& message, const Specification& specification,
          Measurements& measurements);

/// @throws std::invalid_argument where its rays have other directions than the range finder's
void take(const sensor_msgs::LaserScan& message, const Specification& specification,
          Measurements& measurements);

}  // namespace walker
