// Node of an agent that drives by topics.
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <vector>

#include <ros/callback_queue.h>
#include <ros/console.h>
#include <ros/init.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/subscriber.h>
#include <std_msgs/Float64MultiArray.h>

#include "agents/options.h"
#include "agents/remote_server.h"
#include "agents/sensor_topics.h"
#include "base/printable_text.h"
#include "ros/checked_message.h"
#include "ros/node_main.h"
#include "walker_sim/Episode.h"
#include "walker_sim/observation_builder.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

/// Answers each set of sensor messages with an `effort_command` [N m]. Its callbacks run in the
/// thread that calls `run`.
///
/// The topic `episode` reports where episodes begin and end. If nothing publishes it, as on a
/// robot, there is one endless episode. With seeds, the agent begins each episode through ~reset;
/// without seeds, the server does.
class TopicAgent {
 public:
  TopicAgent(const AgentOptions& options, ros::NodeHandle& node, RemoteServer& server,
             const Specification& specification)
      : options_(options),
        server_(server),
        specification_(specification),
        agent_(make_agent(options, specification, server.world())),
        builder_(make_observation_builder(
            specification.id, {specification.parameters.begin(), specification.parameters.end()})),
        observation_(specification.observation_size()),
        effort_publisher_(node.advertise<std_msgs::Float64MultiArray>("effort_command", 1)),
        sensors_(node, specification, options.stamp_tolerance,
                 [this](ros::Time stamp, const Measurements& measured) {
                   on_measurements(stamp, measured);
                 }),
        episode_subscriber_(subscribe_checked<walker_sim::Episode>(
            node, "episode", 10, [this](const auto& message) { on_episode(*message); },
            ros::TransportHints().tcpNoDelay())) {
    efforts_.data.resize(specification.action_size());
  }

  void run() {
    if (!options_.seeds.empty()) {
      wait_for_connections();
      reset();
    }
    while (ros::ok() && (options_.episodes == 0 || finished_ < options_.episodes)) {
      ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.1));
    }
  }

 private:
  /// An episode that began before the topics are connected would lose its first commands.
  void wait_for_connections() {
    while (ros::ok() && (effort_publisher_.getNumSubscribers() == 0 || !sensors_.are_connected() ||
                         episode_subscriber_.getNumPublishers() == 0)) {
      ros::WallDuration(0.01).sleep();
    }
  }

  void on_measurements(ros::Time stamp, const Measurements& measurements) {
    set_time(stamp);
    if (stamp < began_at_) return;
    measured_at_ = stamp;
    measurements_ = measurements;
    if (!has_ended_) act();
  }

  /// The topic has a connection of its own, so its message may arrive before or after the sensor
  /// messages of the same instant.
  void on_episode(const walker_sim::Episode& episode) {
    if (episode.header.stamp < began_at_) return;
    if (episode.end_reason.empty()) {
      begin_episode(episode);
    } else if (episode.episode == episode_ && !has_ended_) {
      finish_episode(episode);
    }
  }

  void begin_episode(const walker_sim::Episode& episode) {
    // A latched message arrives again after a reconnection.
    if (episode.episode == episode_ && episode.header.stamp == began_at_) return;
    episode_ = episode.episode;
    began_at_ = episode.header.stamp;
    has_ended_ = false;
    builder_->reset();
    agent_->reset();
    // If the episode's first measurements arrived before this message, acts on them now.
    if (!measured_at_.isZero() && measured_at_ >= began_at_) act();
  }

  void finish_episode(const walker_sim::Episode& episode) {
    has_ended_ = true;
    ++finished_;
    ROS_INFO_STREAM("episode " << episode.episode << ": " << episode.length << " steps, return "
                               << episode.episode_return << ", " << printable(episode.end_reason));
    const bool more = options_.episodes == 0 || finished_ < options_.episodes;
    if (more && !options_.seeds.empty()) reset();
  }

  void act() {
    try {
      builder_->build(measurements_, observation_.data());
    } catch (const std::invalid_argument& error) {
      sensors_.set_warning(error.what());
      return;
    }
    const std::vector<double>& action = agent_->act(observation_);
    for (std::size_t i = 0; i < action.size(); ++i) {
      efforts_.data[i] = action[i] * specification_.effort_per_action[i];
    }
    effort_publisher_.publish(efforts_);
  }

  void reset() {
    Transition transition;
    const auto request = [&](Client& client) {
      client.reset(options_.seed_after(finished_), transition);
    };
    try {
      while (ros::ok() && !server_.call(request)) {
      }
      began_at_.fromNSec(transition.stamp);
    } catch (const RequestRefused& error) {
      ROS_ERROR_STREAM(server_.name() << "/reset: " << printable(error.what()));
    }
  }

  const AgentOptions& options_;
  RemoteServer& server_;
  const Specification& specification_;
  std::unique_ptr<Agent> agent_;
  std::unique_ptr<ObservationBuilder> builder_;
  std::vector<double> observation_;
  Measurements measurements_;  // the last ones
  ros::Time measured_at_;      // their stamp; zero: none yet
  ros::Time began_at_;         // older messages belong to earlier episodes
  bool has_ended_ = false;     // the present episode
  std::uint32_t episode_ = 0;  // number of the present one; 0: unknown
  std::size_t finished_ = 0;
  std_msgs::Float64MultiArray efforts_;
  ros::Publisher effort_publisher_;
  SensorTopics sensors_;
  ros::Subscriber episode_subscriber_;
};

void run() {
  const AgentOptions options = read_agent_options();
  ros::NodeHandle node;
  RemoteServer server(node, options.server);
  const std::optional<Specification> specification =
      options.env.empty() ? server.specification() : make(options.env)->specification();
  if (specification) TopicAgent(options, node, server, *specification).run();  // else shutting down
}

}  // namespace
}  // namespace walker

int main(int argc, char** argv) {
  const walker::NodeDescription node{"topic_agent", "topic_agent",
                                     "Drives a walker by topics, as on a robot.",
                                     walker::agent_parameters()};
  return walker::run_node(argc, argv, node, walker::run);
}
