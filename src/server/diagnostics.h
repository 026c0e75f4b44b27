// What an operator wants to know of a server, once a second of wall time.
#pragma once

#include <chrono>
#include <cstdint>

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/node_handle.h>
#include <ros/wall_timer.h>

#include "server/parameter_reader.h"
#include "server/simulation.h"

namespace walker {

/// Counted since the start.
struct ServerCounters {
  std::uint64_t steps = 0;
  std::uint64_t refused_commands = 0;  ///< effort commands with an error, or in lock-step
  std::uint64_t clamped_commands = 0;  ///< actions and efforts beyond the bounds
  std::uint64_t command_timeouts = 0;
  std::uint64_t missed_deadlines = 0;
};

/// Publishes /diagnostics, driven by a wall timer: ros::Time stands still in lock-step.
class Diagnostics {
 public:
  Diagnostics(ros::NodeHandle& node, const Simulation& simulation, const ServerOptions& options,
              const ServerCounters& counters);

 private:
  void describe(diagnostic_updater::DiagnosticStatusWrapper& status);
  double real_time_factor();

  const Simulation& simulation_;
  const ServerOptions& options_;
  const ServerCounters& counters_;
  diagnostic_updater::Updater updater_;
  ros::WallTimer timer_;
  std::uint64_t reported_refused_ = 0;
  std::uint64_t reported_steps_ = 0;
  std::chrono::steady_clock::time_point reported_at_ = std::chrono::steady_clock::now();
};

}  // namespace walker
