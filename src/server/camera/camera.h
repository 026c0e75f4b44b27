// The server's camera: its topics, and ~render.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include <image_transport/camera_publisher.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/time.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <tf2_msgs/TFMessage.h>

#include "ros/throttle.h"
#include "server/batch_calls.h"
#include "server/parameter_reader.h"
#include "server/topics/converters.h"
#include "server/transport/waking.h"
#include "walker_sim/Render.h"
#include "walker_sim/parameters.h"
#include "walker_sim/renderer.h"

namespace walker {

/// A picture to render. The functions are called in the render thread.
struct RenderJob {
  StateCapture captured;
  Parameters camera;  ///< complete
  Channels channels;
  /// While this job waits, a later one that may be skipped replaces it.
  bool may_be_skipped = false;
  /// Called before rendering; false: the job is dropped.
  std::function<bool()> is_wanted;
  /// Receives the picture, and may keep its memory.
  std::function<void(const Camera& camera, Image& image)> finish;
  /// Called if rendering or `finish` throws.
  std::function<void(const std::string& why)> fail;
};

/// Renders jobs in order in a separate thread. Thread and renderers are created at the first job.
class RenderThread {
 public:
  /// @param camera complete
  using MakeRenderer = std::function<std::unique_ptr<Renderer>(const Parameters& camera)>;

  /// @param make_renderer called in the thread
  explicit RenderThread(MakeRenderer make_renderer);
  RenderThread(const RenderThread&) = delete;
  RenderThread& operator=(const RenderThread&) = delete;
  /// Finishes the picture in progress and drops waiting jobs.
  ~RenderThread();

  /// Queues a job and returns at once.
  /// @throws std::system_error if no thread can start
  void render(RenderJob job);

  std::uint64_t num_rendered() const { return num_rendered_; }
  /// Number of jobs that later ones have replaced.
  std::uint64_t num_skipped() const { return num_skipped_; }

 private:
  void run();

  MakeRenderer make_renderer_;
  std::mutex mutex_;  // guards the next three
  std::condition_variable changed_;
  std::deque<RenderJob> waiting_;
  bool is_over_ = false;
  std::atomic<std::uint64_t> num_rendered_{0};
  std::atomic<std::uint64_t> num_skipped_{0};
  std::thread thread_;
};

/// Captures states. A separate thread renders them, and publishes or replies.
class ServerCamera {
 public:
  /// @param pool outlives this
  ServerCamera(ros::NodeHandle& node, Pool& pool, Frames frames, const ServerOptions& options,
               RenderThread::MakeRenderer make_renderer);

  /// Whether a picture is due, at most one per period of simulation time, and has subscribers.
  bool is_due(ros::Time stamp) const;
  /// Publishes a picture of the shown state. Requires `is_due(stamp)`.
  void show(ros::Time stamp);

  /// @throws std::exception with the reason why there will be no reply
  void render(const walker_sim::Render::Request& request, ros::Time stamp,
              const Reply<walker_sim::Render::Response>& reply);

  const RenderThread& thread() const { return thread_; }

 private:
  void log_failure(Throttle& throttle, const std::string& why) const;

  Pool& pool_;
  Walker& shown_;
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
