// One environment and the account of its episode: counters, return, why it ended. No ROS.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "walker_sim/environment.h"

namespace walker {

/// Everything about the present state that a transition tells. Units as in Transition.msg.
struct EpisodeState {
  std::uint32_t episode = 0;  ///< counts resets, from 1; 0: none yet
  std::uint32_t step = 0;
  std::vector<double> action;  ///< of the last step, as given; empty right after a reset
  std::vector<double> observation;
  std::vector<double> info;
  double reward = 0;
  double episode_return = 0;
  bool terminated = false;
  bool truncated = false;
  std::string
      end_reason;  ///< empty while the episode runs; else "terminated: ..." or "truncated: ..."
  std::string error;
  std::optional<std::uint64_t>
      seed;  ///< with which the episode began; none: the generator continued
  GeneratorState generator_state{};  ///< before the reset

  bool has_ended() const { return terminated || truncated; }
};

/// Drives an environment and keeps `EpisodeState` in step with it.
class Simulation {
 public:
  /// @param first_seed for the first reset that brings no seed; none: drawn from the system
  Simulation(std::unique_ptr<Environment> environment, std::optional<std::uint64_t> first_seed);

  /// Begins an episode. @throws std::exception of the engine; then there is no episode
  void reset(std::optional<std::uint64_t> seed);

  /// Makes one step. @throws InvalidAction, ResetNeeded; then nothing has changed
  void step(const std::vector<double>& action);

  const Specification& specification() const { return environment_->specification(); }
  const EpisodeState& state() const { return state_; }
  bool has_episode() const { return state_.episode != 0; }

  /// Measurements of the present state, made at most once per state. Needs an episode whose
  /// simulation has not failed.
  const Sensors& sensors();
  /// Surroundings of the present episode.
  const Scene& scene();

 private:
  void record(const Result& result);

  std::unique_ptr<Environment> environment_;
  std::uint64_t first_seed_;
  EpisodeState state_;
  Sensors sensors_;
  Scene scene_;
  bool sensors_are_fresh_ = false;
};

}  // namespace walker
