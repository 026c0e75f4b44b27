// Pictures, rendered while the simulation goes on. No ROS.
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

#include "walker_sim/parameters.h"
#include "walker_sim/renderer.h"

namespace walker {

/// A picture to be rendered. The functions are called in the thread that does it.
struct RenderJob {
  StateCapture captured;
  Parameters camera;  ///< complete
  Channels channels;
  /// As long as it waits, a later one that may be skipped takes its place.
  bool may_be_skipped = false;
  /// Asked before it is rendered; false: nobody wants it any more.
  std::function<bool()> is_wanted;
  /// Takes the picture, whose memory it may keep.
  std::function<void(const Camera& camera, Image& image)> finish;
  /// Where there is none, or `finish` threw.
  std::function<void(const std::string& why)> fail;
};

/// Renders in a thread of its own, one picture after the other in the order in which they were
/// asked for. Nothing is made before the first.
class RenderThread {
 public:
  /// @param camera complete
  using MakeRenderer = std::function<std::unique_ptr<Renderer>(const Parameters& camera)>;

  /// @param make_renderer called in the thread
  explicit RenderThread(MakeRenderer make_renderer);
  RenderThread(const RenderThread&) = delete;
  RenderThread& operator=(const RenderThread&) = delete;
  /// Ends once the picture in flight is done. Those that wait are forgotten.
  ~RenderThread();

  /// Returns at once.
  /// @throws std::system_error where the system has no thread left
  void render(RenderJob job);

  std::uint64_t num_rendered() const { return num_rendered_; }
  /// Of those that might be skipped.
  std::uint64_t num_skipped() const { return num_skipped_; }

 private:
  void run();

  MakeRenderer make_renderer_;
  std::mutex mutex_;  // of the next three
  std::condition_variable changed_;
  std::deque<RenderJob> waiting_;
  bool is_over_ = false;
  std::atomic<std::uint64_t> num_rendered_{0};
  std::atomic<std::uint64_t> num_skipped_{0};
  std::thread thread_;
};

}  // namespace walker
