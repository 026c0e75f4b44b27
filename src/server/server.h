// The environment server: services, commands, and the loop that steps when nobody else does.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <ros/node_handle.h>
#include <ros/service_server.h>
#include <ros/subscriber.h>
#include <std_msgs/Float64MultiArray.h>
#include <std_srvs/Trigger.h>

#include "server/diagnostics.h"
#include "server/effort_command.h"
#include "server/pacer.h"
#include "server/parameter_reader.h"
#include "server/publishers.h"
#include "server/simulation.h"
#include "server/simulation_clock.h"
#include "walker_sim/GetSpec.h"
#include "walker_sim/Reset.h"
#include "walker_sim/Step.h"

namespace walker {

/// One environment on ROS. Callbacks, steps and publishing all happen in the thread that calls
/// `run`, so that nothing moves while a service answers.
class Server {
 public:
  /// @throws std::exception when the environment cannot be made or /clock has another publisher
  explicit Server(const ServerOptions& options);

  /// Serves until the node is told to stop.
  void run();

 private:
  // What decides who steps: the tables Modes and Time.
  bool runs_freely() const;
  bool follows_clock() const;
  void step_when_due();
  void follow_clock();
  void step_freely();

  void reset(std::optional<std::uint64_t> seed);
  void step(const std::vector<double>& action);

  bool on_reset(walker_sim::Reset::Request& request, walker_sim::Reset::Response& response);
  bool on_step(walker_sim::Step::Request& request, walker_sim::Step::Response& response);
  bool on_get_spec(walker_sim::GetSpec::Request& request, walker_sim::GetSpec::Response& response);
  bool on_pause(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);
  bool on_unpause(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);
  void on_effort_command(const std_msgs::Float64MultiArray& message);
  void count_if_clamped(const std::vector<double>& action);
  void refuse(const std::string& reason);

  ServerOptions options_;
  ros::NodeHandle node_;
  ros::NodeHandle private_node_;
  Simulation simulation_;
  ros::Duration dt_;
  SimulationClock clock_;
  Publishers publishers_;
  Pacer pacer_;
  EffortCommand command_;
  bool paused_;
  ServerCounters counters_;
  Diagnostics diagnostics_;

  ros::ServiceServer reset_service_;
  ros::ServiceServer step_service_;
  ros::ServiceServer get_spec_service_;
  ros::ServiceServer pause_service_;
  ros::ServiceServer unpause_service_;
  ros::Subscriber effort_subscriber_;
};

}  // namespace walker
