#include "rviz_plugins/push_tool.h"

#include <algorithm>
#include <cmath>

#include <OgreCamera.h>
#include <OgreRay.h>
#include <OgreSceneManager.h>
#include <OgreViewport.h>
#include <ros/names.h>
#include <rviz/display_context.h>
#include <rviz/frame_manager.h>
#include <rviz/render_panel.h>
#include <rviz/selection/selection_handler.h>
#include <rviz/selection/selection_manager.h>
#include <rviz/view_controller.h>
#include <rviz/viewport_mouse_event.h>
#include <pluginlib/class_list_macros.hpp>

#include "walker_sim/Transition.h"

namespace walker {
namespace {

Eigen::Vector3d to_eigen(const Ogre::Vector3& vector) {
  return Eigen::Vector3f(vector.x, vector.y, vector.z).cast<double>();
}

Ogre::Vector3 to_ogre(const Eigen::Vector3d& vector) {
  const Eigen::Vector3f single = vector.cast<float>();
  return {single.x(), single.y(), single.z()};
}

}  // namespace

PushTool::PushTool()
    : topic_(
          new rviz::StringProperty("Topic", "push", "Topic of the pushes", getPropertyContainer())),
      prefix_(new rviz::StringProperty("TF Prefix", "", "Prefix of the links' frames",
                                       getPropertyContainer())),
      stiffness_(new rviz::FloatProperty("Newtons per metre", 100, "Force per length of the drag",
                                         getPropertyContainer())) {
  shortcut_key_ = 'u';
}

PushTool::~PushTool() = default;

void PushTool::onInitialize() {
  setName("Push");
  setDescription("Push: drag a link of the walker. Elsewhere a drag moves the camera.");
  arrow_ = std::make_unique<rviz::Arrow>(context_->getSceneManager());
  arrow_->setColor(0.9F, 0.35F, 0.05F, 1);
  arrow_->getSceneNode()->setVisible(false);
}

/// Publishes once for each of the server's steps, which need not be as many as rviz's pictures.
void PushTool::activate() {
  show_status("Drag a link to push it. Elsewhere a drag moves the camera.");
  {
    const std::lock_guard lock(mutex_);
    publisher_ = node_.advertise<geometry_msgs::WrenchStamped>(topic_->getStdString(), 10);
  }
  ros::SubscribeOptions options = ros::SubscribeOptions::create<walker_sim::Transition>(
      ros::names::append(ros::names::parentNamespace(node_.resolveName(topic_->getStdString())),
                         "transition"),
      1, [this](const walker_sim::Transition::ConstPtr& /*step*/) { publish(); },
      ros::VoidConstPtr(), context_->getThreadedQueue());
  options.transport_hints = ros::TransportHints().tcpNoDelay();
  steps_ = node_.subscribe(options);
}

void PushTool::deactivate() {
  release();
  steps_.shutdown();
}

void PushTool::update(float /*wall_dt*/, float /*ros_dt*/) {
  if (grip_) pull();
}

int PushTool::processMouseEvent(rviz::ViewportMouseEvent& event) {
  if (event.leftDown()) {
    grip_ = grip_at(event);
    if (grip_) move_goal(event);
  }
  if (!grip_) {
    if (event.panel->getViewController() != nullptr) {
      event.panel->getViewController()->handleMouseEvent(event);
    }
    setStatus(status_);  // the view controller has set its own
    return 0;
  }
  if (event.leftUp()) {
    release();
  } else if (event.type == QEvent::MouseMove) {
    move_goal(event);
  }
  return Render;
}

/// Returns the frame's present pose in the fixed frame; none if it is not known.
std::optional<Eigen::Isometry3d> PushTool::pose_of(const std::string& frame) const {
  Ogre::Vector3 origin;
  Ogre::Quaternion turn;
  if (!context_->getFrameManager()->getTransform(frame, ros::Time(), origin, turn)) {
    return std::nullopt;
  }
  const Eigen::Quaternionf single(turn.w, turn.x, turn.y, turn.z);
  return Eigen::Translation3d(to_eigen(origin)) * single.cast<double>().normalized();
}

/// Returns the name of the link under the mouse, or an empty string. rviz names a link only in the
/// properties of its selection.
std::string PushTool::find_link(rviz::ViewportMouseEvent& event) const {
  rviz::M_Picked picked;
  rviz::SelectionManager* const selection = context_->getSelectionManager();
  selection->pick(event.viewport, event.x, event.y, event.x + 1, event.y + 1, picked, true);
  for (const auto& [handle, object] : picked) {
    rviz::SelectionHandler* const handler = selection->getHandler(handle);
    if (handler == nullptr) continue;
    rviz::Property properties;
    handler->createProperties(object, &properties);
    std::string name;
    if (properties.numChildren() > 0) name = properties.childAt(0)->getNameStd();
    handler->destroyProperties(object, &properties);
    const std::string kind = "Link ";
    if (name.compare(0, kind.size(), kind) == 0) return name.substr(kind.size());
  }
  return "";
}

std::optional<PushTool::Grip> PushTool::grip_at(rviz::ViewportMouseEvent& event) {
  Ogre::Vector3 clicked;
  const std::string link = find_link(event);
  if (link.empty() ||
      !context_->getSelectionManager()->get3DPoint(event.viewport, event.x, event.y, clicked)) {
    show_status("No link under the mouse: the drag moves the camera.");
    return std::nullopt;
  }
  Eigen::Vector3d point = to_eigen(clicked);
  const std::string prefix = prefix_->getStdString();
  Grip grip{prefix.empty() ? link : prefix + "/" + link, {}, point.y()};
  const std::optional<Eigen::Isometry3d> pose = pose_of(grip.frame);
  if (!pose) {
    show_status(QString::fromStdString("No transform of " + grip.frame +
                                       " (TF Prefix in Tool Properties): the drag moves the "
                                       "camera."));
    return std::nullopt;
  }
  point.y() = pose->translation().y();
  grip.point = pose->inverse() * point;
  return grip;
}

/// Moves the goal to where the mouse's ray meets the plane of the clicked point, parallel to the
/// plane of motion.
void PushTool::move_goal(rviz::ViewportMouseEvent& event) {
  const auto width = static_cast<float>(event.viewport->getActualWidth());
  const auto height = static_cast<float>(event.viewport->getActualHeight());
  const Ogre::Ray ray = event.viewport->getCamera()->getCameraToViewportRay(
      static_cast<float>(event.x) / width, static_cast<float>(event.y) / height);
  const Eigen::Vector3d eye = to_eigen(ray.getOrigin());
  const Eigen::Vector3d direction = to_eigen(ray.getDirection());
  const double distance = (grip_->depth - eye.y()) / direction.y();
  if (std::isfinite(distance) && distance > 0) goal_ = eye + distance * direction;
  pull();
}

/// Computes the wrench at the link's present pose, and publishes and shows it.
void PushTool::pull() {
  const std::optional<Eigen::Isometry3d> pose = pose_of(grip_->frame);
  if (!pose) {
    release();
    return;
  }
  Eigen::Vector3d held = *pose * grip_->point;
  held.y() = grip_->depth;
  Eigen::Vector3d drag = goal_ - held;
  drag.y() = 0;
  const Eigen::Vector3d world_force = double{stiffness_->getFloat()} * drag;
  const Eigen::Vector3d force = pose->linear().transpose() * world_force;
  const Eigen::Vector3d torque = grip_->point.cross(force);
  geometry_msgs::WrenchStamped message;
  message.header.frame_id = grip_->frame;
  message.wrench.force.x = force.x();
  message.wrench.force.z = force.z();
  message.wrench.torque.y = torque.y();
  {
    const std::lock_guard lock(mutex_);
    wrench_ = message;
  }
  publish();

  constexpr float kThickness = 0.07F;  // [m]
  const auto length = static_cast<float>(drag.norm());
  const bool is_visible = length > kThickness;
  arrow_->getSceneNode()->setVisible(is_visible);
  if (is_visible) {
    const float head = std::min(0.25F, length / 2);
    arrow_->set(length - head, kThickness, head, 2.5F * kThickness);
    arrow_->setPosition(to_ogre(held));
    arrow_->setDirection(to_ogre(drag));
  }
  if (publisher_.getNumSubscribers() == 0) {
    show_status(QString::fromStdString("No server subscribes to " + publisher_.getTopic()));
  } else {
    show_status(QString::fromStdString("Pushing " + grip_->frame) +
                QString(" with %1 N").arg(force.norm(), 0, 'f', 0));
  }
}

/// Cancels a push that has not acted: a paused server would apply it in its next step.
void PushTool::release() {
  grip_.reset();
  arrow_->getSceneNode()->setVisible(false);
  const std::lock_guard lock(mutex_);
  if (!wrench_) return;
  wrench_->wrench = {};
  publisher_.publish(*wrench_);
  wrench_.reset();
}

void PushTool::publish() {
  const std::lock_guard lock(mutex_);
  if (wrench_) publisher_.publish(*wrench_);
}

/// Shows the text until the next one, also beside the view controller's texts.
void PushTool::show_status(const QString& text) {
  status_ = text;
  setStatus(text);
}

}  // namespace walker

PLUGINLIB_EXPORT_CLASS(walker::PushTool, rviz::Tool)
