// Conversions of the core's types to ROS messages, and of pushes from them: frames, signs, units.
#pragma once

#include <geometry_msgs/WrenchStamped.h>
#include <nav_msgs/Odometry.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/LaserScan.h>
#include <std_msgs/Header.h>
#include <tf2_msgs/TFMessage.h>
#include <string>

#include "episode/walker.h"
#include "server/parameter_reader.h"
#include "walker_sim/Contacts.h"
#include "walker_sim/EnvironmentSpec.h"
#include "walker_sim/Episode.h"
#include "walker_sim/Transition.h"
#include "walker_sim/renderer.h"
#include "walker_sim/sensors.h"
#include "walker_sim/specification.h"

namespace walker {

/// Queue length of topics whose subscribers need every message (longer if recorded), and upper
/// bound of a request's steps, so that its messages overflow no queue.
constexpr std::uint32_t kListenerQueue = 100;

/// Frame names with the tf_prefix and without a leading slash; links as in the robot description.
struct Frames {
  /// @throws std::invalid_argument if a link has the name of another frame
  Frames(const Specification& specification, const std::string& tf_prefix);

  std::string odometry;
  std::string trunk;
  std::string base_link;  ///< REP 105's name for the trunk
  std::string lidar;
  std::string camera;               ///< optical frame: x to the right, y down, z forward
  std::vector<std::string> links;   ///< in specification order
  std::vector<std::string> turned;  ///< per joint: its child, or the link on which that is fixed
};

// Each converter fills a message with its header. The message's vectors keep their capacity.

void to_message(const EpisodeState& state, const Frames& frames, ros::Time stamp,
                walker_sim::Transition& message);
void to_message(const EpisodeState& state, const Frames& frames, ros::Time stamp,
                walker_sim::Episode& message);
/// @param world of the resets to come
void to_message(const Specification& specification, const ServerOptions& options,
                const World& world, walker_sim::EnvironmentSpec& message);
void to_message(const Specification& specification, const Sensors& sensors, ros::Time stamp,
                sensor_msgs::JointState& message);
void to_message(const Specification& specification, const Sensors& sensors, const Frames& frames,
                ros::Time stamp, walker_sim::Contacts& message);

/// REP 117: +infinity if a ray hit nothing.
void to_message(const Specification& specification, const Sensors& sensors, const Frames& frames,
                ros::Time stamp, sensor_msgs::LaserScan& message);

/// REP 145: orientation in the odometry frame; angular velocity and specific force (acceleration
/// minus gravity) in the trunk's frame.
void to_message(const Sensors& sensors, const Frames& frames, ros::Time stamp,
                sensor_msgs::Imu& message);

/// Twist of the trunk's origin, in the trunk's frame.
void to_message(const Sensors& sensors, const Frames& frames, ros::Time stamp,
                nav_msgs::Odometry& message);

/// odom -> trunk, one transform per joint from the bodies' poses, and the gravity-aligned lidar if
/// there is one. One message, so that no listener ever has half of a state.
void to_message(const Specification& specification, const Sensors& sensors, const Frames& frames,
                ros::Time stamp, tf2_msgs::TFMessage& message);

/// Depth in metres if the picture has it, else colours, whose buffer is swapped with the message's.
void to_message(Image& image, const Frames& frames, ros::Time stamp, sensor_msgs::Image& message);

/// A pinhole camera without distortion. Pixel centres have integer coordinates, as in
/// image_geometry. For a parallel projection K, R and P are zero, which the message defines as
/// uncalibrated. The distortion model is always set, because tools that store pictures require it.
void to_message(const Camera& camera, const Frames& frames, ros::Time stamp,
                sensor_msgs::CameraInfo& message);

/// odom -> camera.
void to_message(const Pose& camera, const Frames& frames, ros::Time stamp,
                tf2_msgs::TFMessage& message);

/// Static transforms: REP 105's base_link, and links fixed on the link that their joint turns.
tf2_msgs::TFMessage static_transforms(const Specification& specification, const Frames& frames,
                                      ros::Time stamp);

/// Turns a push by hand, a wrench in the frame of a link, which acts at the frame's origin, into
/// axes of the world.
/// @param sensors of the present state
/// @throws std::invalid_argument naming a frame that is neither a link nor base_link, a component
///         that is non-finite or too large, or one out of the plane of motion
LinkWrench to_link_wrench(const geometry_msgs::WrenchStamped& message, const Frames& frames,
                          const Sensors& sensors);

}  // namespace walker
