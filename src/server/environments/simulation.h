// One environment, the account of its episode, and records of it. No ROS.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/episode_record.h"
#include "server/environments/shown_environment.h"
#include "walker_sim/environment.h"
#include "walker_sim/renderer.h"

namespace walker {

/// Drives an environment, keeps `EpisodeState` in step with it and remembers what was done.
class Simulation : public ShownEnvironment {
 public:
  /// @param make       makes the environment, and then its twin, in which records are repeated
  /// @param first_seed for the first reset where that brings no seed; none: drawn from the system
  Simulation(const std::function<std::unique_ptr<Environment>()>& make,
             std::optional<std::uint64_t> first_seed);

  /// Begins an episode. Without a seed the generator continues. Where the engine fails, the episode
  /// has ended with that (`EpisodeState::failed_at_reset`).
  void reset(std::optional<std::uint64_t> seed);

  /// Begins the episode that began from this state of the generator, as `reset`.
  /// @param seed that the state came from, for the account; none: it was a continued one
  /// @throws std::invalid_argument for a state that no generator has; then nothing has changed
  void begin(const GeneratorState& state, std::optional<std::uint64_t> seed);

  /// Makes one step. @throws InvalidAction, ResetNeeded; then nothing has changed
  void step(const std::vector<double>& action);

  /// The present episode up to now.
  /// @throws std::logic_error when there is none, when it cannot be repeated, or when it is longer
  ///         than `kMostRecordedSteps`
  EpisodeRecord record() const;

  /// A new episode that is, and goes on, as the recorded one.
  /// @throws std::invalid_argument naming what keeps this environment from repeating it; then
  ///         nothing has changed
  void restore(EpisodeRecord record);

  // The same piece by piece. Until `finish_restore` the present episode stays as it is, and may go
  // on, end and be followed by others.

  /// Gives up what has been begun before. @throws as `restore`
  void begin_restore(EpisodeRecord record);
  /// Repeats steps, one at least, up to the record's end or about this time.
  /// @return whether it has come to the record's end
  /// @throws as `restore`; then another is to be begun
  bool go_on_restoring(std::chrono::steady_clock::time_point until);
  /// Once it has: the repeated episode takes the present one's place.
  void finish_restore();

  /// Takes down the present state. @throws ResetNeeded when there is none
  void look(Instant& instant) { walker::look(*present_.environment, state().step, instant); }

  const Specification& specification() const override { return specification_; }
  const EpisodeState& state() const override { return present_.state; }
  const Sensors& sensors() override;
  const Scene& scene() override;

  /// An endless episode must not fill the memory: its record is given up (at 6 joints, 48 MB).
  static constexpr std::uint32_t kMostRecordedSteps = 1000000;

 private:
  /// An environment, and what has been done in it.
  struct Course {
    explicit Course(std::unique_ptr<Environment> made);
    void begin(const GeneratorState& generator_state, std::optional<std::uint64_t> seed);
    void step(const std::vector<double>& action);
    void take(const Result& result);

    std::unique_ptr<Environment> environment;
    EpisodeState state;
    std::vector<double> actions;  // step x action
  };

  Course present_;
  Course twin_;                  // takes the present one's place after a restore
  EpisodeRecord restored_;       // what is repeated in the twin
  Specification specification_;  // outlives that
  std::uint64_t first_seed_;
  Sensors sensors_;
  Scene scene_;
  bool sensors_are_fresh_ = false;
};

}  // namespace walker
