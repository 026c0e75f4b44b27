#include "server/camera/render_thread.h"

#include <algorithm>
#include <cstddef>
#include <exception>
#include <list>
#include <utility>

namespace walker {
namespace {

/// Cache of renderers: making one takes longer than rendering with it.
class Renderers {
 public:
  explicit Renderers(const RenderThread::MakeRenderer& make) : make_(make) {}

  /// @return the camera of the renderer, which is discarded if it throws, as it may not work again
  const Camera& render(const RenderJob& job, Image& image) {
    Renderer& renderer = find(job.camera);
    try {
      renderer.render(job.captured, job.channels, image);
    } catch (...) {
      kept_.pop_front();
      throw;
    }
    return renderer.camera();
  }

 private:
  struct Kept {
    Parameters camera;
    std::unique_ptr<Renderer> renderer;
  };

  /// Returns the renderer of this camera; makes it, and evicts the least recently used, if needed.
  Renderer& find(const Parameters& camera) {
    const auto found = std::find_if(kept_.begin(), kept_.end(),
                                    [&](const Kept& kept) { return kept.camera == camera; });
    if (found != kept_.end()) {
      kept_.splice(kept_.begin(), kept_, found);
    } else {
      constexpr std::size_t kMax = 4;  // each may hold an OpenGL context
      if (kept_.size() == kMax) kept_.pop_back();
      kept_.push_front({camera, make_(camera)});
    }
    return *kept_.front().renderer;
  }

  const RenderThread::MakeRenderer& make_;
  std::list<Kept> kept_;  // most recently used first
};

}  // namespace

RenderThread::RenderThread(MakeRenderer make_renderer) : make_renderer_(std::move(make_renderer)) {}

RenderThread::~RenderThread() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_over_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void RenderThread::render(RenderJob job) {
  if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto skipped = std::find_if(
        waiting_.begin(), waiting_.end(),
        [&](const RenderJob& other) { return job.may_be_skipped && other.may_be_skipped; });
    if (skipped != waiting_.end()) {
      *skipped = std::move(job);
      ++num_skipped_;
    } else {
      waiting_.push_back(std::move(job));
    }
  }
  changed_.notify_one();
}

void RenderThread::run() {
  Renderers renderers(make_renderer_);
  Image image;
  while (true) {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return is_over_ || !waiting_.empty(); });
    if (is_over_) return;
    const RenderJob job = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    if (!job.is_wanted()) continue;
    try {
      const Camera& camera = renderers.render(job, image);
      ++num_rendered_;
      job.finish(camera, image);
    } catch (const std::exception& error) {
      job.fail(error.what());
    }
  }
}

}  // namespace walker
