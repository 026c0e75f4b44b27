// The one door from the core's types to ROS messages: frames, signs, units.
#pragma once

#include <nav_msgs/Odometry.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/LaserScan.h>
#include <std_msgs/Header.h>
#include <tf2_msgs/TFMessage.h>
#include <string>

#include "episode/episode.h"
#include "server/parameter_reader.h"
#include "walker_sim/Contacts.h"
#include "walker_sim/EnvironmentSpec.h"
#include "walker_sim/Episode.h"
#include "walker_sim/Transition.h"
#include "walker_sim/renderer.h"
#include "walker_sim/sensors.h"
#include "walker_sim/specification.h"

namespace walker {

/// Queue length of the topics whose listeners want every message; those of recorders are longer.
/// Upper bound of the steps of one request as well: its messages overflow no queue.
constexpr std::uint32_t kListenerQueue = 100;

/// Names of the frames under the tf_prefix; no leading slash. Links are called as in the robot
/// description.
struct Frames {
  /// @throws std::invalid_argument for a link with the name of another frame
  Frames(const Specification& specification, const std::string& tf_prefix);

  std::string odometry;
  std::string trunk;
  std::string base_link;  ///< REP 105's name for the trunk
  std::string lidar;
  std::string camera;               ///< optical frame: x to the right, y down, z forward
  std::vector<std::string> links;   ///< in specification order
  std::vector<std::string> turned;  ///< by each joint: its child, or what that is fixed on
};

// Each converter fills a message whose vectors keep their capacity from call to call. Headers are
// filled too.

void to_message(const EpisodeState& state, const Frames& frames, ros::Time stamp,
                walker_sim::Transition& message);
void to_message(const EpisodeState& state, const Frames& frames, ros::Time stamp,
                walker_sim::Episode& message);
void to_message(const Specification& specification, const ServerOptions& options,
                walker_sim::EnvironmentSpec& message);
void to_message(const Specification& specification, const Sensors& sensors, ros::Time stamp,
                sensor_msgs::JointState& message);
void to_message(const Specification& specification, const Sensors& sensors, const Frames& frames,
                ros::Time stamp, walker_sim::Contacts& message);

/// REP 117: +infinity where a ray met nothing.
void to_message(const Specification& specification, const Sensors& sensors, const Frames& frames,
                ros::Time stamp, sensor_msgs::LaserScan& message);

/// REP 145: orientation in the odometry frame; angular velocity and specific force (acceleration
/// less gravity) in the trunk's frame.
void to_message(const Sensors& sensors, const Frames& frames, ros::Time stamp,
                sensor_msgs::Imu& message);

/// Twist of the trunk's origin, in the trunk's frame.
void to_message(const Sensors& sensors, const Frames& frames, ros::Time stamp,
                nav_msgs::Odometry& message);

/// odom -> trunk, what every joint turns, from the bodies' own poses, and the gravity-aligned lidar
/// where there is one: together, so that no listener ever has half of a state.
void to_message(const Specification& specification, const Sensors& sensors, const Frames& frames,
                ros::Time stamp, tf2_msgs::TFMessage& message);

/// Depth in metres where the picture has that, else colours. The picture's memory and the message's
/// change places.
void to_message(Image& image, const Frames& frames, ros::Time stamp, sensor_msgs::Image& message);

/// A pinhole without distortion. K, R and P are zero, uncalibrated as the message has it, for a
/// parallel projection; there is no distortion either, and tools that keep pictures want that told.
/// Pixels' centres have whole coordinates, as image_geometry takes them.
void to_message(const Camera& camera, const Frames& frames, ros::Time stamp,
                sensor_msgs::CameraInfo& message);

/// odom -> camera.
void to_message(const Pose& camera, const Frames& frames, ros::Time stamp,
                tf2_msgs::TFMessage& message);

/// What never moves: the trunk under REP 105's name, and links that are fixed on what a joint
/// turns.
tf2_msgs::TFMessage static_transforms(const Specification& specification, const Frames& frames,
                                      ros::Time stamp);

}  // namespace walker
