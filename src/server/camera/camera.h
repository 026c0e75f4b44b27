// The server's camera: its topics, and ~render.
#pragma once

#include <cstdint>

#include <image_transport/camera_publisher.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/time.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <tf2_msgs/TFMessage.h>

#include "ros/throttle.h"
#include "server/camera/render_thread.h"
#include "server/environments.h"
#include "server/parameter_reader.h"
#include "server/topics/converters.h"
#include "server/transport/pending_answer.h"
#include "walker_sim/Render.h"

namespace walker {

/// Captures states. A separate thread renders them, and publishes or replies.
class ServerCamera {
 public:
  /// @param pool outlives this
  ServerCamera(ros::NodeHandle& node, Pool& pool, Frames frames, const ServerOptions& options,
               RenderThread::MakeRenderer make_renderer);

  /// Publishes a picture of the shown state if the topics have subscribers and one is due.
  void show(ros::Time stamp);

  /// @throws std::exception with the reason why there will be no reply
  void render(const walker_sim::Render::Request& request, ros::Time stamp,
              const Reply<walker_sim::Render::Response>& reply);

  const RenderThread& thread() const { return thread_; }

 private:
  void queue_picture(ros::Time stamp);
  void log_failure(const std::string& why) const;
  void publish(const Camera& camera, Image& image, ros::Time stamp);

  Pool& pool_;
  Episode& shown_;
  Frames frames_;
  ServerOptions options_;
  std::uint64_t period_;         // of simulation time [ns]
  std::uint64_t last_turn_ = 0;  // index of the last picture's period

  image_transport::CameraPublisher publisher_;
  ros::Publisher tf_publisher_;

  // Used by the thread.
  sensor_msgs::Image image_;
  sensor_msgs::CameraInfo camera_info_;
  tf2_msgs::TFMessage transforms_;
  Throttle throttle_;
  RenderThread thread_;  // destroyed first
};

}  // namespace walker
