#include "agents/topic_agent.h"

#include <ros/callback_queue.h>
#include <ros/console.h>
#include <ros/init.h>
#include <ros/service.h>

#include "agents/remote_specification.h"
#include "walker_sim/Reset.h"

namespace walker {

TopicAgent::TopicAgent(const AgentOptions& options)
    : options_(options), specification_(ask_specification(node_, options.server)) {
  if (!specification_) return;  // told to stop while waiting
  agent_ = make_agent(options_.agent, *specification_, options_.agent_seed);
  efforts_.data.resize(specification_->action_size());
  effort_publisher_ = node_.advertise<std_msgs::Float64MultiArray>("effort_command", 1);
  transition_subscriber_ = node_.subscribe("transition", 10, &TopicAgent::on_transition, this,
                                           ros::TransportHints().tcpNoDelay());
}

void TopicAgent::run() {
  if (!agent_) return;
  wait_for_connections();
  if (!options_.seeds.empty()) reset(options_.seed_after(0));
  while (ros::ok() && (options_.episodes == 0 || finished_ < options_.episodes)) {
    ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.1));
  }
}

/// A first episode begun before the topics are connected would lose its first commands.
void TopicAgent::wait_for_connections() {
  while (ros::ok() && (effort_publisher_.getNumSubscribers() == 0 ||
                       transition_subscriber_.getNumPublishers() == 0)) {
    ros::WallDuration(0.01).sleep();
  }
}

void TopicAgent::on_transition(const walker_sim::Transition& transition) {
  if (transition.episode != episode_) {
    episode_ = transition.episode;
    agent_->reset();
  }
  if (transition.terminated != 0 || transition.truncated != 0) {
    finish_episode(transition);
    return;
  }
  const std::vector<double>& action = agent_->act(transition.observation);
  for (std::size_t i = 0; i < action.size(); ++i) {
    efforts_.data[i] = action[i] * specification_->effort_per_action[i];
  }
  effort_publisher_.publish(efforts_);
}

void TopicAgent::finish_episode(const walker_sim::Transition& transition) {
  ++finished_;
  ROS_INFO_STREAM("episode " << transition.episode << ": " << transition.step << " steps, return "
                             << transition.episode_return << ", "
                             << (transition.terminated != 0 ? "terminated" : "truncated"));
  const bool more = options_.episodes == 0 || finished_ < options_.episodes;
  if (more && !options_.seeds.empty()) reset(options_.seed_after(finished_));
}

void TopicAgent::reset(std::optional<std::uint64_t> seed) {
  walker_sim::Reset call;
  call.request.has_seed = seed.has_value();
  call.request.seed = seed.value_or(0);
  const bool answered = ros::service::call(options_.server + "/reset", call);
  if (!answered || call.response.success == 0) {
    ROS_ERROR_STREAM(options_.server << "/reset: "
                                     << (answered ? call.response.status_message : "no answer"));
  }
}

}  // namespace walker
