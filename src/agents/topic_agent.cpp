#include "agents/topic_agent.h"

#include <stdexcept>

#include <ros/callback_queue.h>
#include <ros/console.h>
#include <ros/init.h>
#include <ros/service.h>

#include "agents/remote_specification.h"
#include "ros/checked_subscription.h"
#include "walker_sim/Reset.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

std::optional<Specification> find_specification(ros::NodeHandle& node,
                                                const AgentOptions& options) {
  if (options.env.empty()) return ask_specification(node, options.server);
  return make(options.env)->specification();
}

}  // namespace

TopicAgent::TopicAgent(const AgentOptions& options)
    : options_(options), specification_(find_specification(node_, options)) {
  if (!specification_) return;  // told to stop while waiting
  agent_ = make_agent(options_.agent, *specification_, options_.agent_seed);
  const auto& parameters = specification_->parameters;
  builder_ = make_observation_builder(specification_->id, {parameters.begin(), parameters.end()});
  observation_.resize(specification_->observation_size());
  efforts_.data.resize(specification_->action_size());
  effort_publisher_ = node_.advertise<std_msgs::Float64MultiArray>("effort_command", 1);
  sensors_ = std::make_unique<SensorTopics>(
      node_, *specification_, options_.stamp_tolerance,
      [this](ros::Time stamp, const Measurements& measured) { on_measurements(stamp, measured); });
  episode_subscriber_ = subscribe_checked<walker_sim::Episode>(
      node_, "episode", 10, [this](const auto& message) { on_episode(*message); },
      ros::TransportHints().tcpNoDelay());
}

void TopicAgent::run() {
  if (!agent_) return;
  if (!options_.seeds.empty()) {
    wait_for_connections();
    reset(options_.seed_after(0));
  }
  while (ros::ok() && (options_.episodes == 0 || finished_ < options_.episodes)) {
    ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.1));
  }
}

/// A first episode begun before the topics are connected would lose its first commands.
void TopicAgent::wait_for_connections() {
  while (ros::ok() && (effort_publisher_.getNumSubscribers() == 0 || !sensors_->are_connected() ||
                       episode_subscriber_.getNumPublishers() == 0)) {
    ros::WallDuration(0.01).sleep();
  }
}

void TopicAgent::on_measurements(ros::Time stamp, const Measurements& measurements) {
  if (stamp < begun_at_) return;
  measured_at_ = stamp;
  measurements_ = measurements;
  if (!has_ended_) act();
}

/// What is told of an episode comes over a connection of its own, so before or after the sensors'
/// messages of the same instant.
void TopicAgent::on_episode(const walker_sim::Episode& episode) {
  if (episode.header.stamp < begun_at_) return;
  if (episode.end_reason.empty()) {
    begin_episode(episode);
  } else if (episode.episode == episode_ && !has_ended_) {
    finish_episode(episode);
  }
}

void TopicAgent::begin_episode(const walker_sim::Episode& episode) {
  // A latched message is told again after a lost connection.
  if (episode.episode == episode_ && episode.header.stamp == begun_at_) return;
  episode_ = episode.episode;
  begun_at_ = episode.header.stamp;
  has_ended_ = false;
  builder_->reset();
  agent_->reset();
  // Its first measurements were here before it: they are answered only now, or once more.
  if (!measured_at_.isZero() && measured_at_ >= begun_at_) act();
}

void TopicAgent::finish_episode(const walker_sim::Episode& episode) {
  has_ended_ = true;
  ++finished_;
  ROS_INFO_STREAM("episode " << episode.episode << ": " << episode.length << " steps, return "
                             << episode.episode_return << ", " << episode.end_reason);
  const bool more = options_.episodes == 0 || finished_ < options_.episodes;
  if (more && !options_.seeds.empty()) reset(options_.seed_after(finished_));
}

void TopicAgent::act() {
  try {
    builder_->build(measurements_, observation_.data());
  } catch (const std::invalid_argument& error) {
    sensors_->complain(error.what());
    return;
  }
  const std::vector<double>& action = agent_->act(observation_);
  for (std::size_t i = 0; i < action.size(); ++i) {
    efforts_.data[i] = action[i] * specification_->effort_per_action[i];
  }
  effort_publisher_.publish(efforts_);
}

void TopicAgent::reset(std::optional<std::uint64_t> seed) {
  walker_sim::Reset call;
  call.request.has_seed = static_cast<std::uint8_t>(seed.has_value());
  call.request.seed = seed.value_or(0);
  const bool answered = ros::service::call(options_.server + "/reset", call);
  if (!answered || call.response.success == 0) {
    ROS_ERROR_STREAM(options_.server << "/reset: "
                                     << (answered ? call.response.status_message : "no answer"));
    return;
  }
  begun_at_ = call.response.transition.header.stamp;
}

}  // namespace walker
