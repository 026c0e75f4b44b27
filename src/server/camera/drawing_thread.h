// Pictures, drawn while the simulation goes on. No ROS.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "walker_sim/parameters.h"
#include "walker_sim/renderer.h"

namespace walker {

/// A picture to be drawn. The functions are called in the thread that draws.
struct Drawing {
  Instant instant;
  Parameters camera;  ///< complete
  Channels channels;
  /// As long as it waits, a later one that may be skipped takes its place.
  bool may_be_skipped = false;
  /// Asked before it is drawn; false: nobody wants it any more.
  std::function<bool()> is_wanted;
  /// Takes the picture, whose memory it may keep.
  std::function<void(const Camera& camera, Image& image)> finish;
  /// Where there is none, or `finish` threw.
  std::function<void(const std::string& why)> fail;
};

/// Draws in a thread of its own, one picture after the other in the order in which they were asked
/// for. Nothing is made before the first.
class DrawingThread {
 public:
  /// @param camera complete
  using MakeRenderer = std::function<std::unique_ptr<Renderer>(const Parameters& camera)>;

  /// @param make_renderer called in the thread
  explicit DrawingThread(MakeRenderer make_renderer);
  DrawingThread(const DrawingThread&) = delete;
  DrawingThread& operator=(const DrawingThread&) = delete;
  /// Ends once the picture under way is done. Those that wait are forgotten.
  ~DrawingThread();

  /// Returns at once.
  /// @throws std::system_error where the system has no thread left
  void draw(Drawing drawing);

  std::uint64_t num_drawn() const { return num_drawn_; }
  /// Of those that might be skipped.
  std::uint64_t num_skipped() const { return num_skipped_; }

 private:
  void run();
  std::optional<Drawing> wait();

  MakeRenderer make_renderer_;
  std::mutex mutex_;  // of the next three
  std::condition_variable changed_;
  std::deque<Drawing> waiting_;
  bool is_over_ = false;
  std::atomic<std::uint64_t> num_drawn_{0};
  std::atomic<std::uint64_t> num_skipped_{0};
  std::thread thread_;
};

}  // namespace walker
