// Schedules: one class per mode decides when the environments step.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/parameter_reader.h"
#include "server/simulation.h"

namespace walker {

/// Decides whether service calls may step, and steps without calls if its mode does.
class Schedule {
 public:
  using Clock = std::chrono::steady_clock;

  /// Upper bound of a wait: a shutdown is noticed within this time.
  static constexpr std::chrono::milliseconds kIdle{50};

  /// @param simulation outlives this
  explicit Schedule(Simulation& simulation) : simulation_(simulation) {}
  Schedule(const Schedule&) = delete;
  Schedule& operator=(const Schedule&) = delete;
  virtual ~Schedule() = default;

  virtual void start() { restart_schedule(); }

  /// How long the server may wait for requests and callbacks before `step_if_due`: 0 .. kIdle.
  virtual Clock::duration until_due(Clock::time_point /*now*/) const { return kIdle; }

  /// Makes the step or the reset that is due without a request.
  virtual void step_if_due() {}

  /// @throws std::logic_error naming the service unless its callers may step now
  virtual void require_steps_by_service(const std::string& /*service*/) const {}

  /// Begins an episode. The next step is due a period later.
  /// @param world of this and the following episodes; nullopt: as before
  /// @return the state after the reset
  /// @throws std::runtime_error if the engine fails; then the episode has ended with that
  const EpisodeState& reset(std::optional<std::uint64_t> seed,
                            const std::optional<World>& world = std::nullopt);

  /// Called after a pause or a reset: the next step is due a period later, and none is missed.
  virtual void restart_schedule() { simulation_.timing().interrupt(); }

  /// Whether effort commands drive the walker.
  virtual bool takes_commands() const = 0;

  /// @param factor simulation time over wall time, 0 .. 1000; 0: as fast as possible
  /// @throws std::exception with the reason if it cannot be set
  virtual void set_real_time_factor(double factor) = 0;
  /// The pace that this schedule keeps; none if service calls or /clock set it.
  virtual std::optional<double> real_time_factor() const { return std::nullopt; }

  /// @return a message that says what has changed
  virtual std::string pause() = 0;
  virtual std::string unpause() = 0;
  virtual bool is_paused() const { return false; }
  /// Whether this server's time follows another node's /clock.
  virtual bool follows_clock() const { return false; }
  /// Whether nothing moves without a service call.
  bool stands_still() const { return is_paused() || !takes_commands(); }

  /// What sets the pace, e.g. "follows /clock", or how it is kept.
  virtual const char* pace() const = 0;
  /// Why nothing moves although it should; empty if nothing is wrong.
  virtual std::string complaint() const { return ""; }

 protected:
  virtual void begin_episode(std::optional<std::uint64_t> seed, const std::optional<World>& world) {
    simulation_.reset(seed, world);
  }

  Simulation& simulation_;
};

/// Makes the schedule of the mode. Free without publish_clock follows /clock if use_sim_time is
/// set.
std::unique_ptr<Schedule> make_schedule(const ServerOptions& options, Simulation& simulation);

}  // namespace walker
