// What an operator wants to know of a server, once a second of wall time.
#pragma once

#include <chrono>
#include <cstdint>

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/node_handle.h>
#include <ros/wall_timer.h>

#include "core/episode_recorder.h"
#include "core/pacer.h"
#include "server/camera/drawing_thread.h"
#include "server/parameter_reader.h"
#include "server/time/clock_follower.h"
#include "server/time/simulation_clock.h"
#include "server/time/step_timing.h"
#include "server/topics/effort_command.h"
#include "server/topics/episode_statistics.h"
#include "server/topics/recorder_watch.h"

namespace walker {

/// Counted since the start, of all environments.
struct ServerCounters {
  std::uint64_t steps = 0;
  std::uint64_t resets = 0;    ///< restores too
  std::uint64_t advances = 0;  ///< of simulation time, by one dt each
  std::uint64_t simulation_errors = 0;
  std::uint64_t refused_commands = 0;  ///< effort commands with an error, or in lock-step
  std::uint64_t clamped_commands = 0;  ///< actions and efforts beyond the bounds
  std::uint64_t command_timeouts = 0;
  std::uint64_t missed_deadlines = 0;
};

/// All that the diagnostics read; outlives them.
struct DiagnosedServer {
  const ServerOptions& options;
  const EpisodeRecorder& shown;
  const Pacer& pacer;
  const EffortCommand& command;
  const bool& paused;
  const ServerCounters& counters;
  const EpisodeStatistics& episodes;
  StepTiming& timing;  ///< each report begins it anew
  const ClockFollower& follower;
  const SimulationClock& clock;
  bool follows_clock;  ///< of another publisher
  const DrawingThread& pictures;
  const RecorderWatch& recorder;
};

/// Publishes /diagnostics, driven by a wall timer: ros::Time stands still in lock-step. Four
/// statuses, so that each has a level of its own: simulation, pace, commands, episodes.
class Diagnostics {
 public:
  Diagnostics(ros::NodeHandle& node, const DiagnosedServer& server);

 private:
  using Status = diagnostic_updater::DiagnosticStatusWrapper;

  void report();
  void describe_simulation(Status& status);
  void describe_pace(Status& status);
  void describe_commands(Status& status);
  void describe_episodes(Status& status);
  double real_time_factor() const;
  const char* pace() const;

  DiagnosedServer server_;
  diagnostic_updater::Updater updater_;
  ros::WallTimer timer_;
  // As of the last report.
  ServerCounters reported_;
  std::chrono::steady_clock::time_point reported_at_ = std::chrono::steady_clock::now();
};

}  // namespace walker
