// Who steps when.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "server/drive/pacer.h"
#include "server/environments/restores.h"
#include "server/parameter_reader.h"
#include "server/simulation.h"
#include "server/time/clock_follower.h"
#include "server/topics/recorder_watch.h"
#include "server/transport/service_port.h"
#include "server/transport/waking.h"

namespace walker {

/// Answers whoever calls, and steps when nobody else does: at its own pace, or as /clock goes on.
class Loop {
 public:
  /// What it is given but the options outlives it.
  Loop(const ServerOptions& options, Simulation& simulation, Restores& restores, ServicePort& port,
       WakingQueue& callbacks);

  /// Serves until it listens or the node is told to stop.
  void wait_for(const RecorderWatch& recorder);

  /// Serves and steps until the node is told to stop.
  void run();

  // What the services ask for. Each throws a std::exception that says why not.

  /// Begins an episode. @throws also where the engine fails; then the episode has ended with that
  void reset(std::optional<std::uint64_t> seed);
  /// After a pause or a reset: a period passes before the next step, and none has been missed.
  void restart_schedule();
  /// @throws unless who calls this service may step
  void refuse_while_it_runs(const std::string& service) const;
  /// @param factor simulation time over wall time, 0 .. 1000; 0: as fast as it goes
  void set_real_time_factor(double factor);
  /// @return what has changed
  std::string pause();
  std::string unpause();

  bool is_paused() const { return is_paused_; }
  /// In lock-step, where nothing moves by itself.
  bool waits_for_steps() const { return options_.mode == Mode::lockstep; }
  /// The pace that this server keeps; 0: none, for it goes as fast as it can, or somebody else sets
  /// the pace.
  double real_time_factor() const;
  /// Of another publisher.
  bool follows_clock() const { return follows_clock_; }
  const Pacer& pacer() const { return pacer_; }
  const ClockFollower& follower() const { return follower_; }

 private:
  using Clock = Pacer::Clock;

  // What decides who steps: the tables Modes and Time.
  bool runs_freely() const;
  bool waits_to_reset_again(Clock::time_point now) const;
  Clock::duration until_due(Clock::time_point now) const;
  void serve(Clock::duration longest);
  void step_when_due();
  void follow_clock();
  void step_freely();
  void begin_episode(std::optional<std::uint64_t> seed);
  const EpisodeState& state() const { return simulation_.shown().state(); }

  ServerOptions options_;
  Simulation& simulation_;
  Restores& restores_;
  ServicePort& port_;
  WakingQueue& callbacks_;
  bool follows_clock_;
  Pacer pacer_;
  ClockFollower follower_;
  bool is_paused_;
  Clock::time_point resets_again_at_;  // after a reset that failed
};

}  // namespace walker
