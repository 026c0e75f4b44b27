// Diagnostics of a server, once per `diagnostic_period` of wall time.
#pragma once

#include <chrono>

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/node_handle.h>
#include <ros/wall_timer.h>

#include "server/outputs.h"
#include "server/parameter_reader.h"
#include "server/schedule/schedule.h"
#include "server/simulation.h"

namespace walker {

/// Publishes /diagnostics from a wall timer, because ros::Time stands still in lock-step. Four
/// statuses have levels of their own: simulation, pace, commands, episodes.
class Diagnostics {
 public:
  /// @param simulation, schedule, outputs outlive this; a report restarts the simulation's timing
  Diagnostics(ros::NodeHandle& node, ServerOptions options, Simulation& simulation,
              const Schedule& schedule, const Outputs& outputs);

 private:
  using Status = diagnostic_updater::DiagnosticStatusWrapper;

  void report();
  void describe_simulation(Status& status);
  void describe_pace(Status& status);
  void describe_commands(Status& status);
  void describe_episodes(Status& status);
  std::uint64_t new_count(std::uint64_t ServerCounters::*counter) const;
  double real_time_factor() const;

  ServerOptions options_;
  Simulation& simulation_;
  const Schedule& schedule_;
  const Outputs& outputs_;
  diagnostic_updater::Updater updater_;
  ros::WallTimer timer_;
  // Values of the last report.
  ServerCounters reported_;
  std::chrono::steady_clock::time_point reported_at_ = std::chrono::steady_clock::now();
};

}  // namespace walker
