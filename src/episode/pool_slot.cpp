#include "episode/pool_slot.h"

#include <algorithm>
#include <vector>

namespace walker {
namespace {

void write_row(const std::vector<double>& from, double* to, std::size_t row) {
  if (to != nullptr) std::copy(from.begin(), from.end(), to + row * from.size());
}

template <typename T, typename Value>
void write_value(Value value, T* to, std::size_t row) {
  if (to != nullptr) to[row] = value;
}

}  // namespace

PoolSlot::PoolSlot(std::unique_ptr<Environment> environment, std::uint32_t index,
                   AutoresetMode mode)
    : episode_(&episode_of(*environment.release())),
      is_same_step_(mode == AutoresetMode::same_step) {
  episode_->set_index(index);
  if (!is_same_step_) return;
  final_ = episode_->state();
  final_.action.reserve(episode_->specification().action_size());
  final_.end_reason.reserve(kMaxEndReason);
}

void PoolSlot::reset(std::optional<std::uint64_t> seed) {
  wants_reset_ = false;
  episode_->reset(seed);
  keep_final();
}

void PoolSlot::finish_step() {
  keep_final();
  if (has_final_) episode_->reset(std::nullopt);
}

void PoolSlot::keep_final() {
  has_final_ = is_same_step_ && episode_->state().has_ended();
  if (has_final_) final_ = episode_->state();
}

void PoolSlot::write(const Batch& batch, std::size_t row) const {
  const EpisodeState& state = episode_->state();
  const EpisodeState& last = outcome();
  write_row(state.observation, batch.observations, row);
  write_row(state.info, batch.info, row);
  write_value(last.reward, batch.rewards, row);
  write_value(last.terminated, batch.terminated, row);
  write_value(last.truncated, batch.truncated, row);
  write_value(state.episode, batch.episodes, row);
  write_value(state.step, batch.steps, row);
  if (!has_final_) return;
  write_row(last.observation, batch.final_observations, row);
  write_row(last.info, batch.final_info, row);
}

}  // namespace walker
