#include "server/camera/camera.h"

#include <algorithm>
#include <exception>
#include <stdexcept>
#include <utility>
#include <vector>

#include <image_transport/image_transport.h>
#include <ros/console.h>
#include <sensor_msgs/image_encodings.h>

#include "base/parameter_text.h"
#include "base/printable_text.h"
#include "server/topics/converters.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

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
        "; both must have as many");
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

ServerCamera::ServerCamera(ros::NodeHandle& node, Pool& pool, Frames frames,
                           const ServerOptions& options, RenderThread::MakeRenderer make_renderer)
    : pool_(pool),
      shown_(pool.episode(options.shown_environment)),
      frames_(std::move(frames)),
      options_(options),
      period_(period_of(options.camera_rate)),
      publisher_(image_transport::ImageTransport(node).advertiseCamera("camera/image_raw", 1)),
      tf_publisher_(node.advertise<tf2_msgs::TFMessage>("/tf", kListenerQueue)),
      thread_(std::move(make_renderer)) {}

void ServerCamera::show(ros::Time stamp) {
  // At most one picture per period of simulation time.
  const std::uint64_t turn = stamp.toNSec() / period_;
  if (turn == last_turn_ || publisher_.getNumSubscribers() == 0) return;
  if (!shown_.state().error.empty()) return;  // the engine has failed
  last_turn_ = turn;
  try {
    queue_picture(stamp);
  } catch (const std::exception& error) {  // the step itself has succeeded
    static Throttle throttle;
    if (throttle.passes()) log_failure(error.what());
  }
}

void ServerCamera::log_failure(const std::string& why) const {
  ROS_ERROR_STREAM("No pictures on " << publisher_.getTopic() << ": " << why);
}

void ServerCamera::queue_picture(ros::Time stamp) {
  RenderJob job;
  shown_.capture(job.captured);
  job.camera = options_.camera;
  job.may_be_skipped = true;
  job.is_wanted = [this] { return publisher_.getNumSubscribers() > 0; };
  job.finish = [this, stamp](const Camera& camera, Image& image) { publish(camera, image, stamp); };
  job.fail = [this](const std::string& why) {
    if (throttle_.passes()) log_failure(why);
  };
  thread_.render(std::move(job));
}

void ServerCamera::publish(const Camera& camera, Image& image, ros::Time stamp) {
  to_message(image.camera_pose, frames_, stamp, transforms_);
  to_message(camera, frames_, stamp, camera_info_);
  to_message(image, frames_, stamp, image_);
  tf_publisher_.publish(transforms_);
  publisher_.publish(image_, camera_info_);
}

void ServerCamera::render(const walker_sim::Render::Request& request, ros::Time stamp,
                          const Reply<walker_sim::Render::Response>& reply) {
  check_environment(pool_, "environment", request.environment);
  RenderJob job;
  job.channels = channels_of(request.encoding);
  job.camera = camera_of(request, options_);
  pool_.episode(request.environment).capture(job.captured);
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
