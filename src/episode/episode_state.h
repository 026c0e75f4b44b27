// The current state of an episode.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "walker_sim/environment.h"
#include "walker_sim/pool.h"

namespace walker {

// End reasons if the engine fails.
inline constexpr const char* kStepFailed = "the simulation failed";
inline constexpr const char* kResetFailed = "the simulation failed at its reset";

/// The fields of a transition. Units as in Transition.msg.
struct EpisodeState {
  std::uint32_t environment = 0;  ///< index within its pool
  std::uint32_t episode = 0;      ///< counts resets from 1; 0: no reset yet
  std::uint32_t step = 0;         ///< since the reset
  std::vector<double> action;     ///< of the last step, as given; empty right after a reset
  std::vector<double> observation;
  std::vector<double> info;
  double reward = 0;
  double episode_return = 0;
  bool terminated = false;
  bool truncated = false;
  std::string
      end_reason;     ///< empty while the episode runs; else "terminated: ..." or "truncated: ..."
  std::string error;  ///< the engine's message if it failed; else empty
  std::optional<std::uint64_t> seed;  ///< of the reset; nullopt: the generator continued
  GeneratorState generator_state{};   ///< before the reset

  bool has_begun() const { return episode != 0; }
  bool has_ended() const { return terminated || truncated; }
  /// Whether the engine failed at the reset, so that there is no state to observe.
  bool failed_at_reset() const { return step == 0 && has_ended(); }
  /// Why a step is refused, e.g. "the episode ended after 3 steps"; empty if it is allowed.
  std::string step_refusal() const;
  /// The same for a step of a vector environment, whose autoreset may allow steps after the end.
  std::string step_refusal(AutoresetMode mode) const;
  /// `end_reason` without "terminated: " or "truncated: ".
  const char* end_reason_detail() const;
};

}  // namespace walker
