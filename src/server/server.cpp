#include "server/server.h"

#include <sched.h>
#include <sys/prctl.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>

#include <geometry_msgs/WrenchStamped.h>
#include <ros/console.h>
#include <ros/init.h>
#include <ros/transport_hints.h>
#include <std_msgs/Float64MultiArray.h>
#include <std_srvs/Empty.h>
#include <std_srvs/Trigger.h>

#include "base/limits.h"
#include "base/printable_text.h"
#include "ros/checked_message.h"
#include "ros/interposed.h"
#include "ros/message_conversions.h"
#include "ros/throttle.h"
#include "server/gazebo/physics_properties.h"
#include "walker_sim/GetSpec.h"
#include "walker_sim/GetWorlds.h"
#include "walker_sim/Render.h"
#include "walker_sim/Reset.h"
#include "walker_sim/ResetBatch.h"
#include "walker_sim/Restore.h"
#include "walker_sim/SetRealTimeFactor.h"
#include "walker_sim/SetWorld.h"
#include "walker_sim/Snapshot.h"
#include "walker_sim/Step.h"
#include "walker_sim/StepBatch.h"
#include "walker_sim/StepMany.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

constexpr std::chrono::seconds kRecorderStarts{3};  // enough if both start together

/// Upper bound of a ~restore request: the longest recordable episode and its spec's strings.
std::size_t max_record_bytes(const Specification& specification) {
  const std::size_t step_bytes =
      specification.action_size() * sizeof(double) + sizeof(std::uint64_t);
  return kMaxRecordedSteps * step_bytes + kMaxRecordedPushes * kPushBytes +
         kMaxRecordedCoordinates * kCoordinatesBytes + kMaxRecordTextBytes;
}

ros::NodeHandle make_node(WakingQueue& queue) {
  ros::NodeHandle node;
  node.setCallbackQueue(&queue);
  return node;
}

ros::Subscriber subscribe_to_efforts(ros::NodeHandle& node, const Schedule& schedule,
                                     Simulation& simulation) {
  return subscribe_checked<std_msgs::Float64MultiArray>(
      node, "effort_command", 1,
      [&schedule, &simulation](const auto& message, const auto& agent) {
        if (schedule.takes_commands()) {
          simulation.take_command(message->data, agent);
        } else {
          simulation.refuse_command(
              "effort command: in mode lockstep only ~step drives the walker");
        }
      },
      [&simulation](const auto& reason) { simulation.refuse_command("effort command: " + reason); },
      ros::TransportHints().tcpNoDelay());
}

ros::Subscriber subscribe_to_pushes(ros::NodeHandle& node, Simulation& simulation) {
  return subscribe_checked<geometry_msgs::WrenchStamped>(
      node, "push", kListenerQueue,  // those on several links act in the same step
      [&simulation](const auto& message, const auto& /*sender*/) {
        simulation.take_push(*message);
      },
      [&simulation](const auto& reason) { simulation.refuse_push(reason); },
      ros::TransportHints().tcpNoDelay());
}

/// Warns if robot_description lacks a link: viewers would draw the walker wrong, or not at all.
void check_robot_description(const ros::NodeHandle& node, const Specification& specification) {
  std::string key;
  std::string description;
  if (!node.searchParam("robot_description", key) || !node.getParam(key, description)) return;
  for (const Link& link : specification.links) {
    if (description.find("<link name=\"" + link.name + "\"") != std::string::npos) continue;
    ROS_WARN_STREAM(key << " has no link " << link.name << ": it describes another robot than "
                        << specification.id << "; walker.launch makes it from its arguments env "
                        << "and xml_file, not from config");
    return;
  }
}

/// Sets the calling thread's scheduling policy. Threads that it starts keep the ordinary one.
/// @throws std::runtime_error naming the parameter, the reason and the remedy
void schedule(int realtime_priority) {
  // The default slack of timers delays the end of a sleep by up to 50 us.
  prctl(PR_SET_TIMERSLACK, 1);
  if (realtime_priority == 0) return;
  const sched_param parameters{realtime_priority};
  if (sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameters) == 0) return;
  throw std::runtime_error("parameter realtime_priority = " + std::to_string(realtime_priority) +
                           ": " + std::generic_category().message(errno) +
                           "; allow it with ulimit -r, with a line `USER - rtprio " +
                           std::to_string(realtime_priority) +
                           "` in /etc/security/limits.d, or set it to 0");
}

std::string name(const char* service) { return ros::NodeHandle("~").resolveName(service); }

/// Makes the call and sets `success`. If it throws, clears the response and sets `status_message`.
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

template <typename Service, typename Call>
void advertise(ServicePort& port, const char* service, const Call& call,
               std::size_t array_bytes = 0) {
  port.advertise<Service>(
      name(service),
      [call](auto& request, auto& response) { answer(response, [&] { call(request, response); }); },
      array_bytes);
}

/// @param call keeps the reply, or throws a std::exception with the reason
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

template <typename Call>
void advertise_trigger(ServicePort& port, const char* service, const Call& call) {
  port.advertise<std_srvs::Trigger>(name(service), [call](auto&, auto& response) {
    response.message = call();
    response.success = 1;
  });
}

/// Makes the call, and logs an exception before it rethrows it.
template <typename Call>
void call_and_log(const char* service, const Call& call) {
  try {
    call();
  } catch (const std::exception& error) {
    static Throttle throttle;
    if (throttle.passes()) {
      ROS_ERROR_STREAM(service << ": " << error.what() << throttle.left_out());
    }
    throw;
  }
}

/// An Empty response has no field for a reason: the server logs it, and the client's call fails.
template <typename Call>
void advertise_empty(ServicePort& port, const char* service, const Call& call) {
  port.advertise<std_srvs::Empty>(name(service),
                                  [service, call](auto&, auto&) { call_and_log(service, call); });
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
      pool_(make_pool(options, make_environment)),
      clock_(options.publish_clock ? SimulationClock(node_, pool_.specification().dt)
                                   : SimulationClock(pool_.specification().dt)),
      outputs_(node_, pool_, clock_, options, make_renderer),
      simulation_(options, pool_, clock_, outputs_),
      restores_(simulation_, outputs_, make_environment),
      port_(options.spin),
      schedule_(make_schedule(options, simulation_)),
      diagnostics_(node_, options, simulation_, *schedule_, outputs_),
      effort_subscriber_(subscribe_to_efforts(node_, *schedule_, simulation_)),
      push_subscriber_(subscribe_to_pushes(node_, simulation_)) {
  if (options_.recorder.empty()) advertise_services();
  const Specification& specification = pool_.specification();
  ROS_INFO_STREAM("walker_sim " << version() << ": " << specification.id << " on "
                                << specification.engine << " " << specification.engine_version
                                << " from " << specification.engine_path << ", mode "
                                << to_text(options_.mode));
  ROS_INFO_STREAM(listening_addresses());
  check_robot_description(node_, specification);
}

void Server::run() {
  schedule(options_.realtime_priority);
  const bool on_wall_time = !options_.publish_clock && !ros::Time::isSimTime();
  if (on_wall_time) clock_.catch_up(ros::Time::now());
  // Time starts above zero, so that ros::Time::waitForValid does not block until the first reset.
  if (!schedule_->follows_clock()) clock_.advance();
  outputs_.publish_constants();
  if (!options_.recorder.empty()) {
    // Clients wait for services, so none resets before the recorder listens.
    wait_for_recorder();
    if (!ros::ok()) return;
    advertise_services();
  }
  schedule_->start();
  while (ros::ok()) {
    serve(std::min<Schedule::Clock::duration>(schedule_->until_due(Schedule::Clock::now()),
                                              outputs_.longest_wait()));
    if (ros::ok()) schedule_->step_if_due();
    catch_up();
  }
}

/// A state that cannot be shown does not end the server: a call would have answered with the
/// reason.
void Server::catch_up() {
  try {
    outputs_.catch_up();
  } catch (const std::exception& error) {
    static Throttle throttle;
    if (throttle.passes()) ROS_ERROR_STREAM("The topics do not show the state: " << error.what());
  }
}

void Server::wait_for_recorder() {
  std::string complaint = outputs_.recorder_complaint();
  ROS_INFO_STREAM("Waiting for the recorder: " << complaint);
  Schedule::Clock::time_point is_late = Schedule::Clock::now() + kRecorderStarts;
  while (ros::ok() && !complaint.empty()) {
    if (Schedule::Clock::now() >= is_late) {
      ROS_WARN_STREAM("Nothing moves yet: " << complaint);
      is_late += kRecorderStarts;
    }
    serve(Schedule::kIdle);
    complaint = outputs_.recorder_complaint();
  }
}

/// Blocks at most `longest` until requests or callbacks arrive, handles them, continues restores.
void Server::serve(Schedule::Clock::duration longest) {
  if (restores_.are_in_flight()) longest = Schedule::Clock::duration::zero();
  if (port_.serve(callbacks_.descriptor(), longest)) callbacks_.call();
  if (restores_.continue_first()) schedule_->restart_schedule();
}

void Server::advertise_services() {
  advertise<walker_sim::Reset>(port_, "reset", [this](const auto& request, auto& response) {
    const std::optional<std::uint64_t> seed = request.seed;
    const EpisodeState& state =
        schedule_->reset(request.has_seed != 0 ? seed : std::nullopt, to_world(request.world));
    response.transition = outputs_.message(state);
    to_message(state.drawn_world(), response.world);
  });
  advertise<walker_sim::Step>(port_, "step", [this](const auto& request, auto& response) {
    schedule_->require_steps_by_service("step");
    const EpisodeState& state = simulation_.step(request.action);
    simulation_.record_stepping(port_.caller());
    response.transition = outputs_.message(state);
  });
  advertise<StepMany>(port_, "step_many", [this](const auto& request, auto& response) {
    schedule_->require_steps_by_service("step_many");
    const EpisodeState& state = simulation_.step_many(request, response);
    simulation_.record_stepping(port_.caller());
    response.transition = outputs_.message(state);
  });
  advertise<SetState>(port_, "set_state", [this](const auto& request, auto& response) {
    schedule_->require_steps_by_service("set_state");
    response.transition = outputs_.message(simulation_.set_state(request));
  });
  constexpr std::size_t kResetBytes =
      sizeof(std::uint32_t) + sizeof(std::uint8_t) + sizeof(std::uint64_t) + kMaxWorldBytes;
  advertise<ResetBatch>(
      port_, "reset_batch",
      [this](const auto& request, auto& response) {
        simulation_.reset_batch(request, response);
        schedule_->restart_schedule();
      },
      pool_.options().num_envs * kResetBytes);
  advertise<SetWorld>(
      port_, "set_world", [this](const auto& request, auto&) { simulation_.set_worlds(request); },
      pool_.options().num_envs * (sizeof(std::uint32_t) + kMaxWorldBytes));
  advertise<StepBatch>(
      port_, "step_batch",
      [this](const auto& request, auto& response) {
        schedule_->require_steps_by_service("step_batch");
        simulation_.step_batch(request.actions, response);
        simulation_.record_stepping(port_.caller());
      },
      pool_.options().num_envs * pool_.specification().action_size() * sizeof(double));
  port_.advertise<walker_sim::GetSpec>(
      name("get_spec"), [this](auto&, auto& response) { response.spec = outputs_.spec(); });
  port_.advertise<walker_sim::GetWorlds>(name("get_worlds"),
                                         [worlds = list_worlds(options_, pool_.specification())](
                                             auto&, auto& response) { response = worlds; });
  advertise<walker_sim::Snapshot>(port_, "snapshot", [this](auto&, auto& response) {
    response.record = simulation_.snapshot();
  });
  advertise_pending<walker_sim::Restore>(
      port_, "restore",
      [this](const auto& request, const auto& reply) { restores_.add(request.record, reply); },
      max_record_bytes(pool_.specification()));
  advertise_pending<walker_sim::Render>(port_, "render",
                                        [this](const auto& request, const auto& reply) {
                                          outputs_.camera().render(request, clock_.now(), reply);
                                        });
  advertise<walker_sim::SetRealTimeFactor>(
      port_, "set_real_time_factor",
      [this](const auto& request, auto&) { schedule_->set_real_time_factor(request.factor); });
  advertise_trigger(port_, "pause", [this] { return schedule_->pause(); });
  advertise_trigger(port_, "unpause", [this] { return schedule_->unpause(); });
  advertise_gazebo_services();
}

void Server::advertise_gazebo_services() {
  const auto reset = [this] { schedule_->reset(std::nullopt); };
  advertise_empty(port_, "pause_physics", [this] { schedule_->pause(); });
  advertise_empty(port_, "unpause_physics", [this] {
    const std::string outcome = schedule_->unpause();
    // A client that then waits for motion would wait forever.
    if (schedule_->stands_still()) throw std::logic_error(outcome);
  });
  advertise_empty(port_, "reset_simulation", reset);
  advertise_empty(port_, "reset_world", reset);
  // With the gravity of the shown episode's world.
  const auto present = [this] {
    Specification specification = pool_.specification();
    double& gravity = specification.gravity[2];
    gravity = value_or(simulation_.shown().world_values(), "gravity", gravity);
    return specification;
  };
  advertise<gazebo::GetPhysicsProperties>(
      port_, "get_physics_properties", [this, present](auto&, auto& response) {
        gazebo::get_physics_properties(present(), *schedule_, response);
      });
  advertise<gazebo::SetPhysicsProperties>(
      port_, "set_physics_properties", [this, present](const auto& request, auto& response) {
        // Gazebo accepts all values, so clients seldom check the response.
        call_and_log("set_physics_properties", [&] {
          gazebo::set_physics_properties(request, present(), *schedule_, response);
        });
      });
}

}  // namespace walker
