// A robot's sensor topics: their messages as measurements, synchronised by stamp.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <message_filters/pass_through.h>
#include <nav_msgs/Odometry.h>
#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <ros/wall_timer.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/LaserScan.h>

#include "walker_sim/Contacts.h"
#include "walker_sim/observation_builder.h"
#include "walker_sim/specification.h"

namespace walker {

// The inverse of src/server/topics/converters.h. Each function sets the fields that its topic
// carries, in the order of the specification.

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

/// Subscribes to joint_states, imu, odom, contacts and, if the observation contains ranges, scan,
/// and combines messages of the same instant into measurements. Logs once per second of wall
/// time what is missing. All callbacks, including the receiver, run from the node handle's queue.
class SensorTopics {
 public:
  /// @param stamp the oldest stamp of the set
  using Receiver = std::function<void(ros::Time stamp, const Measurements& measurements)>;

  /// @param stamp_tolerance largest difference between the stamps of a set [s]; 0: equal stamps. A
  ///                        topic's period should be more than twice as long.
  SensorTopics(ros::NodeHandle& node, const Specification& specification, double stamp_tolerance,
               Receiver receiver);

  /// Whether every topic has a publisher.
  bool are_connected() const;

  /// Sets the message of the next report, replacing an earlier one.
  void set_warning(const std::string& warning) { warning_ = warning; }

 private:
  /// A topic, and its messages since the last report or complete set.
  struct Input {
    ros::Subscriber subscriber;
    int unmatched = 0;
    ros::Time newest;  // last stamp
  };

  template <typename Message>
  void subscribe(ros::NodeHandle& node, const std::string& topic,
                 message_filters::PassThrough<Message>& messages);
  template <typename... Messages>
  void match_by_stamp(message_filters::PassThrough<Messages>&... messages);
  template <typename... Messages>
  void receive(const boost::shared_ptr<const Messages>&... messages);
  void report();
  std::string missing_text() const;

  Specification specification_;
  double stamp_tolerance_;
  Receiver receiver_;
  std::vector<std::unique_ptr<Input>> inputs_;  // callbacks hold their addresses
  message_filters::PassThrough<sensor_msgs::JointState> joint_states_;
  message_filters::PassThrough<sensor_msgs::Imu> imu_;
  message_filters::PassThrough<nav_msgs::Odometry> odometry_;
  message_filters::PassThrough<walker_sim::Contacts> contacts_;
  message_filters::PassThrough<sensor_msgs::LaserScan> scan_;  // idle without observed ranges
  std::shared_ptr<void> synchronizer_;  // its type depends on the topics and the tolerance
  Measurements measurements_;
  std::string warning_;        // for the next report
  bool has_received_ = false;  // a complete set since the last report
  ros::WallTimer timer_;
};

}  // namespace walker
