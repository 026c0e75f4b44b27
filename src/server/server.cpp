#include "server/server.h"

#include <string>

#include <ros/console.h>
#include <ros/init.h>
#include <ros/transport_hints.h>
#include <std_msgs/Float64MultiArray.h>

#include "ros/checked_subscription.h"
#include "server/services.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

/// Whose callbacks come through `queue`.
ros::NodeHandle make_node(WakingQueue& queue) {
  ros::NodeHandle node;
  node.setCallbackQueue(&queue);
  return node;
}

SimulationClock make_clock(ros::NodeHandle& node, double dt, bool is_owner) {
  return is_owner ? SimulationClock::owner(node, dt) : SimulationClock::silent(dt);
}

ros::Subscriber subscribe_to_efforts(ros::NodeHandle& node, Simulation& simulation) {
  return subscribe_checked<std_msgs::Float64MultiArray>(
      node, "effort_command", 1,
      [&simulation](const auto& message) { simulation.take_command(message->data); },
      [&simulation](const auto& reason) { simulation.refuse_command("effort command: " + reason); },
      ros::TransportHints().tcpNoDelay());
}

/// A walker of one name under the description of another would be shown wrong, or not at all.
void compare_with_description(const ros::NodeHandle& node, const Specification& specification) {
  std::string key;
  std::string description;
  if (!node.searchParam("robot_description", key) || !node.getParam(key, description)) return;
  for (const Link& link : specification.links) {
    if (description.find("<link name=\"" + link.name + "\"") != std::string::npos) continue;
    ROS_WARN_STREAM(key << " has no link " << link.name << ", so it describes another robot than "
                        << specification.id << "; walker.launch makes it from its arguments env "
                        << "and xml_file, not from config");
    return;
  }
}

void introduce(const Specification& specification, const ServerOptions& options) {
  ROS_INFO_STREAM("walker_sim " << version() << ": " << specification.id << " on "
                                << specification.engine << " " << specification.engine_version
                                << " from " << specification.engine_path << ", mode "
                                << to_text(options.mode));
}

}  // namespace

Server::Server(const ServerOptions& options)
    : Server(
          options, [&options] { return make(options.id, options.environment); },
          [options](const Parameters& camera) {
            return make_renderer(options.id, options.environment, camera);
          }) {}

Server::Server(const ServerOptions& options, const MakeEnvironment& make_environment,
               const MakeRenderer& make_renderer)
    : options_(options),
      node_(make_node(callbacks_)),
      environments_(options, make_environment),
      clock_(make_clock(node_, environments_.specification().dt, options.publish_clock)),
      outputs_(node_, environments_, options, make_renderer),
      simulation_(options, environments_, clock_, outputs_),
      restores_(simulation_, outputs_, make_environment),
      loop_(options, simulation_, restores_, port_, callbacks_),
      diagnostics_(node_, options, simulation_, loop_, outputs_),
      effort_subscriber_(subscribe_to_efforts(node_, simulation_)) {
  if (options_.recorder.empty()) offer_services();
  introduce(environments_.specification(), options_);
  compare_with_description(node_, environments_.specification());
}

void Server::run() {
  const bool on_wall_time = !options_.publish_clock && !ros::Time::isSimTime();
  if (on_wall_time) clock_.catch_up(ros::Time::now());
  // A first time above zero, so that nobody waits for one before the first reset. Who follows has
  // the time of /clock instead.
  if (!loop_.follows_clock()) clock_.advance();
  outputs_.publish_constants(clock_.now());
  if (!options_.recorder.empty()) {
    // Without services until then, so that nobody's reset comes too early: a client waits for them.
    loop_.wait_for(outputs_.recorder_watch());
    if (!ros::ok()) return;
    offer_services();
  }
  loop_.run();
}

void Server::offer_services() {
  advertise_services({simulation_, loop_, outputs_, restores_}, port_);
  advertise_gazebo_services(loop_, options_.mode, port_);
}

}  // namespace walker
