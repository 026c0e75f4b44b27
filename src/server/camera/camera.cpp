#include "server/camera/camera.h"

#include <algorithm>
#include <cstddef>
#include <exception>
#include <list>
#include <stdexcept>
#include <utility>
#include <vector>

#include <image_transport/image_transport.h>
#include <ros/console.h>
#include <sensor_msgs/image_encodings.h>

#include "base/parameter_text.h"
#include "base/printable_text.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

/// Cache by camera, most recently used first: making a renderer takes longer than rendering with
/// it.
using Renderers = std::list<std::pair<Parameters, std::unique_ptr<Renderer>>>;

/// Takes the renderer of this camera out of the cache, or makes it and if needed evicts another.
Renderers take_renderer(const Parameters& camera, const RenderThread::MakeRenderer& make,
                        Renderers& cache) {
  constexpr std::size_t kMax = 4;  // each may hold an OpenGL context
  Renderers taken;
  const auto found = std::find_if(cache.begin(), cache.end(),
                                  [&](const auto& cached) { return cached.first == camera; });
  if (found != cache.end()) {
    taken.splice(taken.begin(), cache, found);
  } else {
    if (cache.size() == kMax) cache.pop_back();
    taken.emplace_front(camera, make(camera));
  }
  return taken;
}

Channels channels_of(const std::string& encoding) {
  namespace encodings = sensor_msgs::image_encodings;
  if (encoding.empty() || encoding == encodings::RGB8) return {true, false};
  if (encoding == encodings::TYPE_32FC1) return {false, true};
  throw std::invalid_argument("encoding = " + encoding + "; must be rgb8 or 32FC1");
}

/// Camera parameters of a request, completed from the server's.
Parameters camera_of(const walker_sim::Render::Request& request, const ServerOptions& options) {
  if (request.parameter_names.size() != request.parameter_values.size()) {
    throw std::invalid_argument(
        "parameter_names has " + std::to_string(request.parameter_names.size()) +
        " texts and parameter_values " + std::to_string(request.parameter_values.size()) +
        "; the numbers must be equal");
  }
  const auto descriptions = camera_parameter_descriptions(options.id);
  std::vector<std::string> assignments;
  for (std::size_t i = 0; i < request.parameter_names.size(); ++i) {
    std::string name = request.parameter_names[i];
    for (const ParameterDescription& description : descriptions) {
      if (name == camera_parameter(description.name)) name = description.name;
    }
    assignments.push_back(name + "=" + request.parameter_values[i]);
  }
  Parameters given = parse_assignments(descriptions, assignments);
  given.insert(options.camera.begin(), options.camera.end());  // those that the request lacks
  return complete_parameters(descriptions, given);
}

/// @param rate [1/s]; 0: one per state, since states are more than a nanosecond apart
/// @return [ns]
std::uint64_t period_of(double rate) {
  constexpr double kPerSecond = 1e9;
  constexpr double kMax = 1e18;  // fits into 64 bits
  return rate > 0 ? static_cast<std::uint64_t>(std::min(kPerSecond / rate, kMax)) : 1;
}

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
  Renderers cache;
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
      Renderers taken = take_renderer(job.camera, make_renderer_, cache);
      Renderer& renderer = *taken.front().second;
      renderer.render(job.captured, job.channels, image);
      cache.splice(cache.begin(), taken);  // not if it throws, as it may not work again
      ++num_rendered_;
      job.finish(renderer.camera(), image);
    } catch (const std::exception& error) {
      job.fail(error.what());
    }
  }
}

ServerCamera::ServerCamera(ros::NodeHandle& node, Pool& pool, Frames frames,
                           const ServerOptions& options, RenderThread::MakeRenderer make_renderer)
    : pool_(pool),
      shown_(pool.walker(options.shown_environment)),
      frames_(std::move(frames)),
      options_(options),
      period_(period_of(options.camera_rate)),
      publisher_(image_transport::ImageTransport(node).advertiseCamera("camera/image_raw", 1)),
      tf_publisher_(node.advertise<tf2_msgs::TFMessage>("/tf", kListenerQueue)),
      thread_(std::move(make_renderer)) {}

bool ServerCamera::is_due(ros::Time stamp) const {
  const bool has_failed = !shown_.state().error.empty();
  return !has_failed && stamp.toNSec() / period_ != last_turn_ &&
         publisher_.getNumSubscribers() > 0;
}

void ServerCamera::show(ros::Time stamp) {
  last_turn_ = stamp.toNSec() / period_;
  RenderJob job;
  job.camera = options_.camera;
  job.may_be_skipped = true;
  job.is_wanted = [this] { return publisher_.getNumSubscribers() > 0; };
  job.finish = [this, stamp](const Camera& camera, Image& image) {
    to_message(image.camera_pose, frames_, stamp, transforms_);
    to_message(camera, frames_, stamp, camera_info_);
    to_message(image, frames_, stamp, image_);
    tf_publisher_.publish(transforms_);
    publisher_.publish(image_, camera_info_);
  };
  job.fail = [this](const std::string& why) { log_failure(throttle_, why); };
  try {
    shown_.capture(job.captured);
    thread_.render(std::move(job));
  } catch (const std::exception& error) {  // the step itself has succeeded
    static Throttle throttle;
    log_failure(throttle, error.what());
  }
}

void ServerCamera::log_failure(Throttle& throttle, const std::string& why) const {
  if (!throttle.passes()) return;
  ROS_ERROR_STREAM("No pictures on " << publisher_.getTopic() << ": " << why);
}

void ServerCamera::render(const walker_sim::Render::Request& request, ros::Time stamp,
                          const Reply<walker_sim::Render::Response>& reply) {
  check_environment(pool_, "environment", request.environment);
  RenderJob job;
  job.channels = channels_of(request.encoding);
  job.camera = camera_of(request, options_);
  pool_.walker(request.environment).capture(job.captured);
  job.is_wanted = [reply] { return reply.is_awaited(); };
  job.finish = [this, stamp, reply](const Camera& /*camera*/, Image& image) {
    walker_sim::Render::Response response;
    to_message(image, frames_, stamp, response.image);
    response.success = 1;
    reply(response);
  };
  job.fail = [reply](const std::string& why) {
    walker_sim::Render::Response response;
    response.status_message = printable(why);
    reply(response);
  };
  thread_.render(std::move(job));
}

}  // namespace walker
