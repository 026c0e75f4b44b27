#include "server/topics/diagnostics.h"

#include <exception>
#include <optional>
#include <string>
#include <utility>

#include <ros/console.h>

#include "base/shortest_text.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

using diagnostic_msgs::DiagnosticStatus;
using diagnostic_updater::DiagnosticStatusWrapper;

/// Concatenates the values, with numbers as `status.add` writes them.
template <typename... Values>
std::string sentence(const Values&... values) {
  ClassicStream text;
  (text << ... << values);
  return text.str();
}

/// Raises the level to WARN and appends the text to the message.
void warn(DiagnosticStatusWrapper& status, const std::string& text) {
  status.mergeSummary(DiagnosticStatus::WARN, text);
}

/// Adds a time in microseconds, or a dash if there is none.
template <typename Times>
void add_microseconds(DiagnosticStatusWrapper& status, const char* key,
                      const std::optional<Times>& times, double Times::*seconds) {
  constexpr double kPerSecond = 1e6;
  status.add(key, times ? sentence((*times).*seconds * kPerSecond) : "-");
}

/// E.g. "1 deadline", "2 deadlines".
std::string counted(std::uint64_t count, const char* what) {
  return sentence(count, ' ', what, count == 1 ? "" : "s");
}

const char* to_text(EffortCommand::State state) {
  if (state == EffortCommand::State::held) return "held";
  const bool has_timed_out = state == EffortCommand::State::timed_out;
  return has_timed_out ? "timed out: zero torque" : "none: zero torque";
}

}  // namespace

Diagnostics::Diagnostics(ros::NodeHandle& node, ServerOptions options, Simulation& simulation,
                         const Schedule& schedule, const Outputs& outputs)
    : options_(std::move(options)),
      simulation_(simulation),
      schedule_(schedule),
      outputs_(outputs) {
  updater_.setHardwareID(simulation_.shown().specification().id);
  updater_.add("simulation", this, &Diagnostics::describe_simulation);
  updater_.add("pace", this, &Diagnostics::describe_pace);
  updater_.add("commands", this, &Diagnostics::describe_commands);
  updater_.add("episodes", this, &Diagnostics::describe_episodes);
  timer_ = node.createWallTimer(ros::WallDuration(updater_.getPeriod()),
                                [this](const ros::WallTimerEvent&) { report(); });
}

void Diagnostics::report() {
  simulation_.clock().publish();  // their stamp is the present time
  try {
    updater_.force_update();
  } catch (const std::exception& error) {
    // The updater adds its period to /clock, which overflows near the end of ROS time.
    ROS_ERROR_STREAM("No diagnostics at /clock = " << ros::Time::now() << " s: " << error.what());
    return;
  }
  reported_ = simulation_.counters();
  reported_at_ = std::chrono::steady_clock::now();
}

void Diagnostics::describe_simulation(Status& status) {
  const EpisodeState& state = simulation_.shown().state();
  const std::uint64_t errors = new_count(&ServerCounters::simulation_errors);
  if (!state.error.empty()) {
    status.summary(
        DiagnosticStatus::ERROR,
        (state.failed_at_reset() ? "simulation failed at its reset: " : "simulation failed: ") +
            state.error);
  } else if (errors > 0) {
    status.summary(DiagnosticStatus::ERROR,
                   "simulation failed " + counted(errors, "time") + " since the last report");
  } else if (!state.has_begun()) {
    status.summary(DiagnosticStatus::OK, "waits for the first reset");
  } else if (state.has_ended()) {
    status.summary(DiagnosticStatus::OK, state.end_reason);
  } else {
    status.summary(DiagnosticStatus::OK, schedule_.is_paused() ? "paused" : "running");
  }
  const std::string unrecorded = outputs_.recorder_complaint();
  if (!unrecorded.empty()) {
    warn(status, (state.has_begun() ? "not recorded: " : "nothing moves yet: ") + unrecorded);
  }
  const Specification& specification = simulation_.shown().specification();
  status.add("environment", specification.id);
  status.add("engine", specification.engine);
  status.add("engine_version", specification.engine_version);
  status.add("version", version());
  status.add("mode", walker::to_text(options_.mode));
  status.add("num_envs", options_.num_envs);
  status.add("paused", schedule_.is_paused());
  status.add("episode", state.episode);
  status.add("step", state.step);
  status.add("episode_return", state.episode_return);
  status.add("steps", simulation_.counters().steps);
  status.add("simulation_errors", simulation_.counters().simulation_errors);
  status.add("pictures", outputs_.camera().thread().num_rendered());
  status.add("pictures_skipped", outputs_.camera().thread().num_skipped());
}

/// Increase of a counter since the last report.
std::uint64_t Diagnostics::new_count(std::uint64_t ServerCounters::*counter) const {
  return simulation_.counters().*counter - reported_.*counter;
}

/// Simulation time over wall time since the last report.
double Diagnostics::real_time_factor() const {
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - reported_at_;
  const double simulated = static_cast<double>(new_count(&ServerCounters::advances)) *
                           simulation_.shown().specification().dt;
  return wall.count() > 0 ? simulated / wall.count() : 0;
}

void Diagnostics::describe_pace(Status& status) {
  const double factor = real_time_factor();
  const std::uint64_t missed = new_count(&ServerCounters::missed_deadlines);
  status.summary(DiagnosticStatus::OK, schedule_.pace());
  if (missed > 0) {
    warn(status, sentence("cannot keep up: ", counted(missed, "deadline"),
                          " missed since the last report, ", factor, " times real time"));
  }
  for (const std::string& complaint : {schedule_.complaint(), simulation_.clock().complaint()}) {
    if (!complaint.empty()) warn(status, complaint);
  }
  status.add("real_time_factor", factor);
  const std::optional<double> wanted = schedule_.real_time_factor();
  status.add("real_time_factor_wanted", wanted ? sentence(*wanted) : "-");
  status.add("missed_deadlines", simulation_.counters().missed_deadlines);
  const StepTiming::Report timing = simulation_.timing().report();
  add_microseconds(status, "jitter_p50_us", timing.jitter, &StepTiming::Jitter::median);
  add_microseconds(status, "jitter_p99_us", timing.jitter, &StepTiming::Jitter::percentile_99);
  add_microseconds(status, "jitter_p999_us", timing.jitter, &StepTiming::Jitter::percentile_999);
  add_microseconds(status, "jitter_max_us", timing.jitter, &StepTiming::Jitter::largest);
  add_microseconds(status, "step_time_mean_us", timing.duration, &StepTiming::Duration::mean);
  add_microseconds(status, "step_time_max_us", timing.duration, &StepTiming::Duration::largest);
}

void Diagnostics::describe_commands(Status& status) {
  const ServerCounters& counters = simulation_.counters();
  const EffortCommand::State state = simulation_.command().state();
  const std::string text =
      schedule_.takes_commands() ? to_text(state) : "refused: ~step drives the walker";
  status.summary(DiagnosticStatus::OK, "effort command: " + text);
  if (const std::uint64_t refused = new_count(&ServerCounters::refused_commands)) {
    warn(status, counted(refused, "effort command") + " refused since the last report");
  }
  if (const std::uint64_t contested = new_count(&ServerCounters::contested_commands)) {
    warn(status, "two agents drive the walker: " + counted(contested, "effort command") +
                     " replaced another node's");
  }
  if (const std::uint64_t contested = new_count(&ServerCounters::contested_steps)) {
    warn(status,
         "two agents step the walker: " + counted(contested, "step") + " after another node's");
  }
  if (const std::uint64_t refused = new_count(&ServerCounters::refused_pushes)) {
    warn(status, sentence(refused, refused == 1 ? " push" : " pushes",
                          " refused since the last report: ", simulation_.push_refusal()));
  }
  if (state == EffortCommand::State::timed_out ||
      new_count(&ServerCounters::command_timeouts) > 0) {
    warn(status, sentence("no effort command for ", options_.command_timeout, " s: zero torque"));
  }
  status.add("effort_command", text);
  status.add("refused_commands", counters.refused_commands);
  status.add("contested_commands", counters.contested_commands);
  status.add("contested_steps", counters.contested_steps);
  status.add("clamped_commands", counters.clamped_commands);
  status.add("command_timeouts", counters.command_timeouts);
  status.add("pushes", counters.pushes);
  status.add("refused_pushes", counters.refused_pushes);
  status.add("push_refusal", simulation_.push_refusal().empty() ? "-" : simulation_.push_refusal());
}

void Diagnostics::describe_episodes(Status& status) {
  const EpisodeStatistics::Summary summary = simulation_.episodes().summary();
  status.summary(DiagnosticStatus::OK,
                 summary.episodes == 0
                     ? "no episode has ended yet"
                     : sentence("mean return ", summary.return_mean, " over the last ",
                                counted(summary.episodes, "episode")));
  status.add("finished_episodes", summary.episodes);
  status.add("return_mean", summary.return_mean);
  status.add("return_std", summary.return_deviation);
  status.add("return_min", summary.return_min);
  status.add("return_max", summary.return_max);
  status.add("length_mean", summary.length_mean);
  status.add("terminated", summary.terminated);
  status.add("truncated", summary.truncated);
  status.add("failed", summary.failed);
}

}  // namespace walker
