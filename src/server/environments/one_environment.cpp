#include "server/environments/one_environment.h"

#include <algorithm>

#include "core/action_check.h"

namespace walker {

void OneEnvironment::reset(const std::vector<std::uint32_t>& environments,
                           const std::vector<std::optional<std::uint64_t>>& seeds,
                           const Batch& rows) {
  if (environments.empty()) return;
  simulation_.reset(seeds.empty() ? std::nullopt : seeds.front());
  write(rows);
}

void OneEnvironment::step(const std::vector<double>& actions, const Batch& rows) {
  const EpisodeState& state = simulation_.state();
  const bool resets = autoreset_mode_ == AutoresetMode::next_step
                          ? state.has_ended()
                          : autoreset_mode_ == AutoresetMode::same_step && state.failed_at_reset();
  if (resets) {
    check_action(simulation_.specification(), actions.data(), actions.size());  // though ignored
    simulation_.reset(std::nullopt);
  } else {
    simulation_.step(actions);
  }
  write(rows);
}

void OneEnvironment::write(const Batch& rows) const {
  const EpisodeState& state = simulation_.state();
  std::copy(state.observation.begin(), state.observation.end(), rows.observations);
  std::copy(state.info.begin(), state.info.end(), rows.info);
  *rows.episodes = state.episode;
  *rows.steps = state.step;
  if (rows.rewards == nullptr) return;
  *rows.rewards = state.reward;
  *rows.terminated = static_cast<std::uint8_t>(state.terminated);
  *rows.truncated = static_cast<std::uint8_t>(state.truncated);
}

}  // namespace walker
