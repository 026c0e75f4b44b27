// The environment server.
#pragma once

#include <ros/node_handle.h>
#include <ros/subscriber.h>

#include "server/batch_calls.h"
#include "server/outputs.h"
#include "server/parameter_reader.h"
#include "server/schedule/schedule.h"
#include "server/simulation.h"
#include "server/time/simulation_clock.h"
#include "server/topics/diagnostics.h"
#include "server/transport/service_port.h"
#include "server/transport/waking.h"

namespace walker {

/// Serves a pool of environments over ROS. Services, callbacks and steps run in the thread that
/// calls `run`, so no state changes while a service answers. Pictures have their own thread.
class Server {
 public:
  using MakeRenderer = RenderThread::MakeRenderer;

  /// @throws std::exception if the environment cannot be made or /clock has another publisher
  explicit Server(const ServerOptions& options);
  /// Serves environments and renderers that the registry does not know.
  /// @param make_renderer called in the render thread
  Server(const ServerOptions& options, const MakeEnvironment& make_environment,
         const MakeRenderer& make_renderer);

  /// Serves until the node shuts down.
  void run();

 private:
  void catch_up();
  void wait_for_recorder();
  void serve(Schedule::Clock::duration longest);

  void advertise_services();
  /// Advertises services with Gazebo's names and types, because a remap cannot change the type that
  /// a client expects. Both resets begin an episode; simulation time continues.
  void advertise_gazebo_services();

  ServerOptions options_;
  WakingQueue callbacks_;
  ros::NodeHandle node_;
  Pool pool_;
  SimulationClock clock_;
  Outputs outputs_;
  Simulation simulation_;
  Restores restores_;
  ServicePort port_;
  std::unique_ptr<Schedule> schedule_;
  Diagnostics diagnostics_;
  ros::Subscriber effort_subscriber_;
  ros::Subscriber push_subscriber_;
};

}  // namespace walker
