#include "server/server.h"

#include <cstddef>
#include <cstdint>
#include <exception>
#include <optional>
#include <stdexcept>
#include <string>

#include <ros/console.h>
#include <ros/init.h>
#include <ros/node_handle.h>
#include <ros/transport_hints.h>
#include <std_msgs/Float64MultiArray.h>
#include <std_srvs/Empty.h>
#include <std_srvs/Trigger.h>

#include "base/limits.h"
#include "base/printable_text.h"
#include "ros/checked_subscription.h"
#include "ros/listening.h"
#include "ros/throttle.h"
#include "server/gazebo/physics_messages.h"
#include "server/gazebo/physics_properties.h"
#include "walker_sim/GetSpec.h"
#include "walker_sim/Render.h"
#include "walker_sim/Reset.h"
#include "walker_sim/ResetBatch.h"
#include "walker_sim/Restore.h"
#include "walker_sim/SetRealTimeFactor.h"
#include "walker_sim/Snapshot.h"
#include "walker_sim/Step.h"
#include "walker_sim/StepBatch.h"
#include "walker_sim/StepMany.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

/// Of the longest episode that is recorded, with the texts of its specification.
std::size_t most_record_bytes(const Specification& specification) {
  return kMostRecordedSteps * specification.action_size() * sizeof(double) + kMostRecordTextBytes;
}

/// Whose callbacks come through `queue`.
ros::NodeHandle make_node(WakingQueue& queue) {
  ros::NodeHandle node;
  node.setCallbackQueue(&queue);
  return node;
}

ros::Subscriber subscribe_to_efforts(ros::NodeHandle& node, Simulation& simulation) {
  return subscribe_checked<std_msgs::Float64MultiArray>(
      node, "effort_command", 1,
      [&simulation](const auto& message, const auto& agent) {
        simulation.take_command(message->data, agent);
      },
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

std::string name(const char* service) { return ros::NodeHandle("~").resolveName(service); }

/// Makes the call and tells how it went. What was half filled is not told.
template <typename Response, typename Call>
void answer(Response& response, const Call& call) {
  try {
    call();
    response.success = 1;
  } catch (const std::exception& error) {
    response = Response();
    response.status_message = printable(error.what());
  }
}

/// @param call fills the response, or throws a std::exception
template <typename Service, typename Call>
void advertise(ServicePort& port, const char* service, const Call& call,
               std::size_t array_bytes = 0) {
  port.advertise<Service>(
      name(service),
      [call](auto& request, auto& response) { answer(response, [&] { call(request, response); }); },
      array_bytes);
}

/// @param call takes the reply with it, or throws a std::exception that says why there is none
template <typename Service, typename Call>
void advertise_pending(ServicePort& port, const char* service, const Call& call,
                       std::size_t array_bytes = 0) {
  port.advertise_pending<Service>(
      name(service),
      [call](auto& request, const auto& reply) {
        typename Service::Response refusal;
        answer(refusal, [&] { call(request, reply); });
        if (refusal.success == 0) reply(refusal);
      },
      array_bytes);
}

/// @param call returns what has changed
template <typename Call>
void advertise_trigger(ServicePort& port, const char* service, const Call& call) {
  port.advertise<std_srvs::Trigger>(name(service), [call](auto& /*request*/, auto& response) {
    response.message = call();
    response.success = 1;
  });
}

/// An empty response has no room for a reason: it is logged, and the client's call fails with it.
/// @param call throws a std::exception that says why not
template <typename Call>
void advertise_empty(ServicePort& port, const char* service, const Call& call) {
  port.advertise<std_srvs::Empty>(name(service), [service, call](auto&, auto&) {
    try {
      call();
    } catch (const std::exception& error) {
      static Throttle throttle;
      if (throttle.passes()) {
        ROS_ERROR_STREAM(service << ": " << error.what() << throttle.left_out());
      }
      throw;
    }
  });
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
      clock_(options.publish_clock ? SimulationClock(node_, environments_.specification().dt)
                                   : SimulationClock(environments_.specification().dt)),
      outputs_(node_, environments_, options, make_renderer),
      simulation_(options, environments_, clock_, outputs_),
      restores_(simulation_, outputs_, make_environment),
      loop_(options, simulation_, restores_, port_, callbacks_),
      diagnostics_(node_, options, simulation_, loop_, outputs_),
      effort_subscriber_(subscribe_to_efforts(node_, simulation_)) {
  if (options_.recorder.empty()) offer_services();
  const Specification& specification = environments_.specification();
  ROS_INFO_STREAM("walker_sim " << version() << ": " << specification.id << " on "
                                << specification.engine << " " << specification.engine_version
                                << " from " << specification.engine_path << ", mode "
                                << to_text(options_.mode));
  ROS_INFO_STREAM(listening_addresses());
  compare_with_description(node_, specification);
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
  offer_steps();
  offer_records();
  offer_pace();
  offer_gazebo_services();
}

void Server::offer_steps() {
  advertise<walker_sim::Reset>(port_, "reset", [this](const auto& request, auto& response) {
    const std::optional<std::uint64_t> seed = request.seed;
    loop_.reset(request.has_seed != 0 ? seed : std::nullopt);
    response.transition = outputs_.take_transition();
  });
  advertise<walker_sim::Step>(port_, "step", [this](const auto& request, auto& response) {
    loop_.refuse_while_it_runs("step");
    simulation_.step(request.action);
    simulation_.note_stepping(port_.caller());
    response.transition = outputs_.take_transition();
  });
  advertise<walker_sim::StepMany>(port_, "step_many", [this](const auto& request, auto& response) {
    loop_.refuse_while_it_runs("step_many");
    simulation_.step_many(request, response);
    simulation_.note_stepping(port_.caller());
    response.transition = outputs_.take_transition();
  });
  constexpr std::size_t kResetBytes =
      sizeof(std::uint32_t) + sizeof(std::uint8_t) + sizeof(std::uint64_t);
  advertise<walker_sim::ResetBatch>(
      port_, "reset_batch",
      [this](const auto& request, auto& response) {
        simulation_.reset_batch(request, response);
        loop_.restart_schedule();
      },
      environments_.size() * kResetBytes);
  advertise<walker_sim::StepBatch>(
      port_, "step_batch",
      [this](const auto& request, auto& response) {
        loop_.refuse_while_it_runs("step_batch");
        simulation_.step_batch(request.actions, response);
        simulation_.note_stepping(port_.caller());
      },
      environments_.size() * environments_.specification().action_size() * sizeof(double));
}

void Server::offer_records() {
  port_.advertise<walker_sim::GetSpec>(name("get_spec"), [this](auto& /*request*/, auto& response) {
    response.spec = outputs_.spec();
  });
  advertise<walker_sim::Snapshot>(port_, "snapshot",
                                  [this](const auto& /*request*/, auto& response) {
                                    response.record = simulation_.snapshot();
                                  });
  advertise_pending<walker_sim::Restore>(
      port_, "restore",
      [this](const auto& request, const auto& reply) { restores_.add(request.record, reply); },
      most_record_bytes(environments_.specification()));
  advertise_pending<walker_sim::Render>(port_, "render",
                                        [this](const auto& request, const auto& reply) {
                                          outputs_.camera().render(request, clock_.now(), reply);
                                        });
}

void Server::offer_pace() {
  advertise<walker_sim::SetRealTimeFactor>(port_, "set_real_time_factor",
                                           [this](const auto& request, auto& /*response*/) {
                                             loop_.set_real_time_factor(request.factor);
                                           });
  advertise_trigger(port_, "pause", [this] { return loop_.pause(); });
  advertise_trigger(port_, "unpause", [this] { return loop_.unpause(); });
}

void Server::offer_gazebo_services() {
  const auto reset = [this] { loop_.reset(std::nullopt); };
  advertise_empty(port_, "pause_physics", [this] { loop_.pause(); });
  advertise_empty(port_, "unpause_physics", [this] {
    const std::string outcome = loop_.unpause();
    // A client that now waits for something to move would wait in vain.
    if (options_.mode == Mode::lockstep) throw std::logic_error(outcome);
  });
  advertise_empty(port_, "reset_simulation", reset);
  advertise_empty(port_, "reset_world", reset);
  const Specification& specification = environments_.specification();
  advertise<gazebo::GetPhysicsProperties>(
      port_, "get_physics_properties", [&](const auto& /*request*/, auto& response) {
        gazebo::get_physics_properties(specification, loop_, response);
      });
  advertise<gazebo::SetPhysicsProperties>(
      port_, "set_physics_properties", [&](const auto& request, auto& response) {
        try {
          gazebo::set_physics_properties(request, specification, loop_, response);
        } catch (const std::exception& error) {
          // Gazebo takes what it is given, so clients seldom look at the answer.
          static Throttle throttle;
          if (throttle.passes()) {
            ROS_WARN_STREAM("set_physics_properties: " << error.what() << throttle.left_out());
          }
          throw;
        }
      });
}

}  // namespace walker
