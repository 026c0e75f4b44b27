// Service requests, as the server reads them, and topic messages, as subscribers read them. The
// first byte selects the type.
#include <stdexcept>

#include <nav_msgs/Odometry.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/LaserScan.h>
#include <std_msgs/Float64MultiArray.h>

#include "fuzz/input.h"
#include "fuzz/target.h"
#include "ros/checked_stream.h"
#include "server/gazebo/physics_properties.h"
#include "walker_sim/Contacts.h"
#include "walker_sim/Render.h"
#include "walker_sim/Reset.h"
#include "walker_sim/ResetBatch.h"
#include "walker_sim/Restore.h"
#include "walker_sim/SetRealTimeFactor.h"
#include "walker_sim/Step.h"
#include "walker_sim/StepBatch.h"
#include "walker_sim/StepMany.h"

namespace walker::fuzz {
namespace {

template <typename Message>
void read_one(const Input& input) {
  Message message;
  read_exactly(input.next(), input.size(), "the request", message);
  require(ros::serialization::serializationLength(message) == input.size(),
          "a request that was read has the length that came");
}

void run(const std::uint8_t* data, std::size_t size) {
  Input input(data, size);
  const auto which = input.number<std::uint8_t>();
  try {
    switch (which % 15) {
      case 0:
        return read_one<walker_sim::StepRequest>(input);
      case 1:
        return read_one<walker_sim::StepBatchRequest>(input);
      case 2:
        return read_one<walker_sim::StepManyRequest>(input);
      case 3:
        return read_one<walker_sim::ResetRequest>(input);
      case 4:
        return read_one<walker_sim::ResetBatchRequest>(input);
      case 5:
        return read_one<walker_sim::RestoreRequest>(input);
      case 6:
        return read_one<walker_sim::RenderRequest>(input);
      case 7:
        return read_one<walker_sim::SetRealTimeFactorRequest>(input);
      case 8:
        return read_one<std_msgs::Float64MultiArray>(input);
      case 9:
        return read_one<gazebo::SetPhysicsProperties::Request>(input);
      case 10:
        return read_one<sensor_msgs::JointState>(input);
      case 11:
        return read_one<sensor_msgs::LaserScan>(input);
      case 12:
        return read_one<sensor_msgs::Imu>(input);
      case 13:
        return read_one<nav_msgs::Odometry>(input);
      default:
        return read_one<walker_sim::Contacts>(input);
    }
  } catch (const std::runtime_error& refusal) {
    accept(refusal);
  }
}

const Registered kTarget("requests", run);

}  // namespace
}  // namespace walker::fuzz
