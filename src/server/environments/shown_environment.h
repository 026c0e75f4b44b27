// The environment that topics and diagnostics tell of, and the account of its episode. No ROS.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "walker_sim/environment.h"

namespace walker {

/// Everything about the present state that a transition tells. Units as in Transition.msg.
struct EpisodeState {
  std::uint32_t environment = 0;  ///< index within its server
  std::uint32_t episode = 0;      ///< counts resets, from 1; 0: none yet
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
  /// The engine refused the reset: there is no state, and `error` says why.
  bool failed_at_reset() const { return step == 0 && has_ended(); }

  /// Takes over flags, reason and error of a step.
  void conclude(bool is_terminated, bool is_truncated, const char* reason, const char* what) {
    terminated = is_terminated;
    truncated = is_truncated;
    end_reason.clear();
    if (has_ended()) end_reason.append(terminated ? "terminated: " : "truncated: ").append(reason);
    error = what;
  }
};

/// What is to be seen of one environment, whether it is alone or one of many.
class ShownEnvironment {
 public:
  ShownEnvironment() = default;
  ShownEnvironment(const ShownEnvironment&) = delete;
  ShownEnvironment& operator=(const ShownEnvironment&) = delete;
  virtual ~ShownEnvironment() = default;

  virtual const Specification& specification() const = 0;
  virtual const EpisodeState& state() const = 0;
  bool has_episode() const { return state().episode != 0; }

  /// Measurements of the present state, made at most once per state. Needs an episode whose
  /// simulation has not failed.
  virtual const Sensors& sensors() = 0;
  /// Surroundings of the present episode.
  virtual const Scene& scene() = 0;
};

}  // namespace walker
