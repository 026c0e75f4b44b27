#include "server/diagnostics.h"

namespace walker {

Diagnostics::Diagnostics(ros::NodeHandle& node, const Simulation& simulation,
                         const ServerOptions& options, const ServerCounters& counters)
    : simulation_(simulation), options_(options), counters_(counters) {
  const Specification& specification = simulation.specification();
  updater_.setHardwareID(specification.id);
  updater_.add("simulation", this, &Diagnostics::describe);
  timer_ = node.createWallTimer(ros::WallDuration(updater_.getPeriod()),
                                [this](const ros::WallTimerEvent&) { updater_.force_update(); });
}

double Diagnostics::real_time_factor() {
  const auto now = std::chrono::steady_clock::now();
  const double wall = std::chrono::duration<double>(now - reported_at_).count();
  const double simulated =
      static_cast<double>(counters_.steps - reported_steps_) * simulation_.specification().dt;
  reported_at_ = now;
  reported_steps_ = counters_.steps;
  return wall > 0 ? simulated / wall : 0;
}

void Diagnostics::describe(diagnostic_updater::DiagnosticStatusWrapper& status) {
  const EpisodeState& state = simulation_.state();
  const bool refused = counters_.refused_commands != reported_refused_;
  reported_refused_ = counters_.refused_commands;
  if (!state.error.empty()) {
    status.summary(diagnostic_msgs::DiagnosticStatus::ERROR, state.error);
  } else if (refused) {
    status.summary(diagnostic_msgs::DiagnosticStatus::WARN, "effort commands were refused");
  } else if (!simulation_.has_episode()) {
    status.summary(diagnostic_msgs::DiagnosticStatus::OK, "waits for the first reset");
  } else {
    status.summary(diagnostic_msgs::DiagnosticStatus::OK,
                   state.has_ended() ? state.end_reason : "running");
  }
  const Specification& specification = simulation_.specification();
  status.add("environment", specification.id);
  status.add("engine", specification.engine + " " + specification.engine_version);
  status.add("mode", to_text(options_.mode));
  status.add("real_time_factor", real_time_factor());
  status.add("episode", state.episode);
  status.add("step", state.step);
  status.add("episode_return", state.episode_return);
  status.add("steps", counters_.steps);
  status.add("missed_deadlines", counters_.missed_deadlines);
  status.add("refused_commands", counters_.refused_commands);
  status.add("clamped_commands", counters_.clamped_commands);
  status.add("command_timeouts", counters_.command_timeouts);
}

}  // namespace walker
