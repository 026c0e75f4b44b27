// Who steps when: one class per mode, behind one interface.
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

/// Decides who may step, and steps by itself if its mode does.
class Drive {
 public:
  using Clock = std::chrono::steady_clock;

  /// Upper bound of a wait: a shutdown is noticed within this time.
  static constexpr std::chrono::milliseconds kIdle{50};

  /// @param simulation outlives this
  explicit Drive(Simulation& simulation) : simulation_(simulation) {}
  Drive(const Drive&) = delete;
  Drive& operator=(const Drive&) = delete;
  virtual ~Drive() = default;

  /// The server begins to serve.
  virtual void start() {}

  /// How long the server may wait for requests and callbacks before `step_if_due`: 0 .. kIdle.
  virtual Clock::duration until_due(Clock::time_point /*now*/) const { return kIdle; }

  /// Makes the step or the reset that is due without a request.
  virtual void step_if_due() {}

  /// @throws std::logic_error naming the service unless its callers may step now
  virtual void require_steps_by_service(const std::string& /*service*/) const {}

  /// Begins an episode, and a period passes before the next step.
  /// @return the state after the reset
  /// @throws std::runtime_error if the engine fails; then the episode has ended with that
  const EpisodeState& reset(std::optional<std::uint64_t> seed);

  /// After a pause or a reset: a period passes before the next step, and none has been missed.
  virtual void restart_schedule() { simulation_.timing().interrupt(); }

  /// @param agent name of the node that has sent the effort command
  virtual void take_command(const std::vector<double>& efforts, const std::string& agent) = 0;
  virtual bool takes_commands() const = 0;

  /// @param factor simulation time over wall time, 0 .. 1000; 0: as fast as it goes
  /// @throws std::exception with the reason why this cannot be set
  virtual void set_real_time_factor(double factor) = 0;
  /// The pace that this drive keeps; none if somebody else sets it.
  virtual std::optional<double> real_time_factor() const { return std::nullopt; }

  /// @return what has changed
  virtual std::string pause() = 0;
  virtual std::string unpause() = 0;
  virtual bool is_paused() const { return false; }
  /// Whether the time of other nodes' /clock is this server's.
  virtual bool follows_clock() const { return false; }
  /// Nothing moves without a service call.
  virtual bool stands_still() const = 0;

  // For diagnostics.

  /// What sets the pace.
  virtual const char* pace() const = 0;
  /// Why nothing moves although it should; empty if nothing is wrong.
  virtual std::string complaint() const { return ""; }

 protected:
  virtual void begin_episode(std::optional<std::uint64_t> seed) { simulation_.reset(seed); }

  Simulation& simulation_;
};

/// The drive of the options' mode: `free` follows /clock if another node publishes it.
std::unique_ptr<Drive> make_drive(const ServerOptions& options, Simulation& simulation);

}  // namespace walker
