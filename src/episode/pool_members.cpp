#include "episode/pool_members.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <stdexcept>
#include <typeinfo>
#include <utility>

#include "episode/failure.h"
#include "base/interruption.h"

namespace walker {
namespace {

std::string name_of(std::size_t index) { return "environment " + std::to_string(index) + ": "; }

/// Of one type and with rows of the same size.
bool are_alike(const Environment& one, const Environment& other) {
  const Specification& a = one.specification();
  const Specification& b = other.specification();
  return typeid(one) == typeid(other) && a.id == b.id && a.parameters == b.parameters &&
         a.observation_size() == b.observation_size() && a.action_size() == b.action_size() &&
         a.info_names == b.info_names;
}

void copy_row(const std::vector<double>& from, std::size_t index, std::size_t size, double* to,
              std::size_t row) {
  if (to) std::copy_n(from.data() + index * size, size, to + row * size);
}

template <typename T, typename Value>
void write_one(Value value, T* to, std::size_t row) {
  if (to) to[row] = value;
}

}  // namespace

PoolMembers::PoolMembers(const std::function<std::unique_ptr<Environment>()>& make,
                         std::size_t count, AutoresetMode mode)
    : mode_(mode), members_(count), phases_(count, Phase::no_episode) {
  for (std::size_t i = 0; i < count; ++i) {
    check_interruption();
    members_[i].environment = make();
    if (!are_alike(environment(i), environment(0))) {
      throw std::invalid_argument(name_of(i) + environment(i).specification().id +
                                  "; must be as the first one, " + specification().id +
                                  " with the same parameters");
    }
  }
  observation_size_ = specification().observation_size();
  num_infos_ = specification().info_names.size();
  observations_.resize(count * observation_size_);
  info_.resize(count * num_infos_);
  if (mode == AutoresetMode::same_step) {
    final_observations_.resize(observations_.size());
    final_info_.resize(info_.size());
  }
  for (std::size_t i = 0; i < count; ++i) {
    Member& member = members_[i];
    member.result.observation = observations_.data() + i * observation_size_;
    member.result.info = info_.data() + i * num_infos_;
    member.call.environment = member.environment.get();
    member.call.result = &member.result;
  }
}

std::size_t PoolMembers::group_size() const {
  return std::clamp<std::size_t>(environment(0).group_size(), 1, Environment::kLargestGroup);
}

void PoolMembers::need_episode(std::size_t index) const {
  if (phases_[index] == Phase::no_episode) {
    throw ResetNeeded(name_of(index) + "there is no episode yet; reset first");
  }
  if (phases_[index] == Phase::running || mode_ != AutoresetMode::disabled) return;
  const Member& member = members_[index];
  throw ResetNeeded(name_of(index) +
                    (member.reset_error.empty()
                         ? "the episode ended after " + std::to_string(member.steps) + " steps"
                         : kResetFailed) +
                    "; reset first");
}

void PoolMembers::reset(std::size_t index, std::optional<std::uint64_t> seed) {
  begin_episode(index, seed);
  take_outcome(index);
}

/// Leaves what is told of the step before it as it is.
void PoolMembers::begin_episode(std::size_t index, std::optional<std::uint64_t> seed) {
  Member& member = members_[index];
  ++member.episode;
  member.steps = 0;
  member.reset_error = try_reset(*member.environment, seed, member.result);
  phases_[index] = member.result.terminated ? Phase::ended : Phase::running;
}

void PoolMembers::step(const std::uint32_t* indices, std::size_t size, const double* actions) {
  const std::size_t action_size = specification().action_size();
  std::array<StepCall*, Environment::kLargestGroup> calls;
  std::array<std::uint32_t, Environment::kLargestGroup> stepped;
  std::size_t num_calls = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const std::uint32_t index = indices[i];
    if (phases_[index] == Phase::ended) {  // requested, or due; else it were refused
      reset(index, std::nullopt);
      continue;
    }
    members_[index].call.action = actions + index * action_size;
    stepped[num_calls] = index;
    calls[num_calls++] = &members_[index].call;
  }
  if (num_calls == 0) return;
  calls[0]->environment->step_together(calls.data(), num_calls, action_size);
  for (std::size_t i = 0; i < num_calls; ++i) conclude_step(stepped[i]);
}

void PoolMembers::conclude_step(std::size_t index) {
  Member& member = members_[index];
  ++member.steps;
  if (member.call.failure) {  // else the rules have told it already
    member.step_error = words_of(std::exchange(member.call.failure, nullptr));
    fail_step(member.step_error.c_str(), specification(), member.result);
  }
  take_outcome(index);
  if (!member.terminated && !member.truncated) return;
  phases_[index] = Phase::ended;
  if (mode_ == AutoresetMode::same_step) begin_episode(index, std::nullopt);
}

/// Of a reset or a step, before another episode begins.
void PoolMembers::take_outcome(std::size_t index) {
  Member& member = members_[index];
  member.reward = member.result.reward;
  member.terminated = member.result.terminated;
  member.truncated = member.result.truncated;
  member.end_reason = member.result.end_reason;
  member.error = member.result.error;
  member.has_final = mode_ == AutoresetMode::same_step && (member.terminated || member.truncated);
  if (!member.has_final) return;
  copy_row(observations_, index, observation_size_, final_observations_.data(), index);
  copy_row(info_, index, num_infos_, final_info_.data(), index);
}

/// Of a reset that failed, the engine's words stand in `error`, as an EpisodeState has them.
void PoolMembers::save_state(std::size_t index, std::vector<std::byte>& state) const {
  const Member& member = members_[index];
  Result last = member.result;
  if (!member.reset_error.empty()) last.error = member.reset_error.c_str();
  member.environment->save_state(last, state);
}

/// All are looked at before the first one changes.
void PoolMembers::load_states(const std::vector<std::uint32_t>& indices,
                              const std::vector<std::vector<std::byte>>& states) {
  for (std::size_t i = 0; i < indices.size(); ++i) {
    try {
      environment(indices[i]).load_state(states[i].data(), states[i].size(), nullptr);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(name_of(indices[i]) + error.what());
    }
  }
  for (std::size_t i = 0; i < indices.size(); ++i) load_state(indices[i], states[i]);
}

void PoolMembers::load_state(std::size_t index, const std::vector<std::byte>& state) {
  Member& member = members_[index];
  const Progress progress =
      member.environment->load_state(state.data(), state.size(), &member.result);
  if (!progress.has_begun) {
    std::fill_n(member.result.observation, observation_size_, 0);
    std::fill_n(member.result.info, num_infos_, 0);
    member.result = {member.result.observation, member.result.info};
  }
  const bool has_ended = member.result.terminated || member.result.truncated;
  const bool failed_at_reset =
      has_ended && std::strcmp(member.result.end_reason, kResetFailed) == 0;
  member.reset_error = failed_at_reset ? member.result.error : "";
  if (failed_at_reset) member.result.error = "";
  member.steps = progress.steps;
  if (progress.has_begun) ++member.episode;
  phases_[index] = has_ended ? Phase::ended : Phase::running;
  if (!progress.has_begun) phases_[index] = Phase::no_episode;
  take_outcome(index);
  member.has_final = false;
}

void PoolMembers::write(std::size_t index, const Batch& batch, std::size_t row) const {
  const Member& member = members_[index];
  copy_row(observations_, index, observation_size_, batch.observations, row);
  copy_row(info_, index, num_infos_, batch.info, row);
  write_one(member.reward, batch.rewards, row);
  write_one(member.terminated, batch.terminated, row);
  write_one(member.truncated, batch.truncated, row);
  write_one(member.episode, batch.episodes, row);
  write_one(member.steps, batch.steps, row);
  if (!member.has_final) return;
  copy_row(final_observations_, index, observation_size_, batch.final_observations, row);
  copy_row(final_info_, index, num_infos_, batch.final_info, row);
}

}  // namespace walker
