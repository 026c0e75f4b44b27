// The environment server.
#pragma once

#include <ros/node_handle.h>
#include <ros/subscriber.h>

#include "server/drive/drive.h"
#include "server/environments.h"
#include "server/outputs.h"
#include "server/parameter_reader.h"
#include "server/restores.h"
#include "server/simulation.h"
#include "server/time/simulation_clock.h"
#include "server/topics/diagnostics.h"
#include "server/transport/service_port.h"
#include "server/transport/waking.h"

namespace walker {

/// Environments on ROS, from their drive to their outputs. Services, callbacks, steps and
/// publishing all happen in the thread that calls `run`, so that nothing moves while a service
/// answers. Only pictures are drawn elsewhere.
class Server {
 public:
  using MakeRenderer = RenderThread::MakeRenderer;

  /// @throws std::exception when the environment cannot be made or /clock has another publisher
  explicit Server(const ServerOptions& options);
  /// The same with environments and renderers that the registry does not know.
  /// @param make_renderer called in another thread
  Server(const ServerOptions& options, const MakeEnvironment& make_environment,
         const MakeRenderer& make_renderer);

  /// Serves until the node is told to stop.
  void run();

 private:
  void wait_for_recorder();
  void serve(Drive::Clock::duration longest);

  // The private services. What a call throws becomes `status_message`.
  void offer_services();
  /// Of Gazebo's names and types, for a remap alone does not serve a client that expects another
  /// type. Both resets begin an episode, and time goes on.
  void offer_gazebo_services();

  ServerOptions options_;
  WakingQueue callbacks_;
  ros::NodeHandle node_;
  Pool pool_;
  SimulationClock clock_;
  Outputs outputs_;
  Simulation simulation_;
  Restores restores_;
  ServicePort port_;
  std::unique_ptr<Drive> drive_;
  Diagnostics diagnostics_;
  ros::Subscriber effort_subscriber_;
};

}  // namespace walker
