// Tool of rviz that pushes the link under the mouse.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include <geometry_msgs/WrenchStamped.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/subscriber.h>
#include <rviz/ogre_helpers/arrow.h>
#include <rviz/properties/float_property.h>
#include <rviz/properties/string_property.h>
#include <rviz/tool.h>
#include <Eigen/Geometry>
#include <QString>

namespace walker {

/// A left drag that begins on a link pulls the clicked point towards the mouse, in the plane of
/// motion, as a spring does. All other drags and the wheel move the camera.
class PushTool : public rviz::Tool {
 public:
  PushTool();
  ~PushTool() override;

  void onInitialize() override;
  void activate() override;
  void deactivate() override;
  void update(float wall_dt, float ros_dt) override;
  int processMouseEvent(rviz::ViewportMouseEvent& event) override;

 private:
  /// The point that is held.
  struct Grip {
    std::string frame;      // of the link
    Eigen::Vector3d point;  // in the link's frame, in the plane through its origin
    double depth;           // y of the clicked point in the fixed frame
  };

  std::optional<Eigen::Isometry3d> pose_of(const std::string& frame) const;
  std::string find_link(rviz::ViewportMouseEvent& event) const;
  std::optional<Grip> grip_at(rviz::ViewportMouseEvent& event);
  void move_goal(rviz::ViewportMouseEvent& event);
  void pull();
  void release();
  void publish();
  void show_status(const QString& text);

  rviz::StringProperty* topic_;
  rviz::StringProperty* prefix_;
  rviz::FloatProperty* stiffness_;
  std::unique_ptr<rviz::Arrow> arrow_;
  std::optional<Grip> grip_;
  Eigen::Vector3d goal_;  // the mouse, in the fixed frame
  QString status_;
  ros::NodeHandle node_;
  ros::Subscriber steps_;

  std::mutex mutex_;  // of the following
  std::optional<geometry_msgs::WrenchStamped> wrench_;
  ros::Publisher publisher_;
};

}  // namespace walker
