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
#include "ros/checked_message.h"
#include "server/gazebo/physics_properties.h"
#include "walker_sim/Contacts.h"
#include "walker_sim/Render.h"
#include "walker_sim/Reset.h"
#include "walker_sim/ResetBatch.h"
#include "walker_sim/Restore.h"
#include "walker_sim/SetRealTimeFactor.h"
#include "walker_sim/SetState.h"
#include "walker_sim/SetWorld.h"
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

template <typename... Messages>
void read_any(std::size_t which, const Input& input) {
  constexpr void (*kReaders[])(const Input&) = {read_one<Messages>...};
  kReaders[which % sizeof...(Messages)](input);
}

void run(const std::uint8_t* data, std::size_t size) {
  Input input(data, size);
  const auto which = input.number<std::uint8_t>();
  try {
    read_any<walker_sim::StepRequest, walker_sim::StepBatchRequest, walker_sim::StepManyRequest,
             walker_sim::ResetRequest, walker_sim::ResetBatchRequest, walker_sim::RestoreRequest,
             walker_sim::RenderRequest, walker_sim::SetRealTimeFactorRequest,
             std_msgs::Float64MultiArray, gazebo::SetPhysicsProperties::Request,
             sensor_msgs::JointState, sensor_msgs::LaserScan, sensor_msgs::Imu, nav_msgs::Odometry,
             walker_sim::Contacts, walker_sim::SetWorldRequest, walker_sim::SetStateRequest>(which,
                                                                                             input);
  } catch (const std::runtime_error& refusal) {
    accept(refusal);
  }
}

const Registered kTarget("requests", run);

}  // namespace
}  // namespace walker::fuzz
