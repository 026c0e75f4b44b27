#include "episode/episode_state.h"

#include "episode/failure.h"

namespace walker {

std::string EpisodeState::step_refusal() const {
  if (has_ended() && !error.empty()) return kStepFailed;
  return step_refusal(AutoresetMode::disabled);
}

std::string EpisodeState::step_refusal(AutoresetMode mode) const {
  if (!has_begun()) return "there is no episode yet";
  if (!has_ended() || mode != AutoresetMode::disabled) return "";
  if (failed_at_reset()) return kResetFailed;
  return "the episode ended after " + std::to_string(step) + " steps";
}

const char* EpisodeState::bare_end_reason() const {
  const std::size_t colon = end_reason.find(": ");
  return colon == std::string::npos ? "" : &end_reason[colon + 2];
}

}  // namespace walker
