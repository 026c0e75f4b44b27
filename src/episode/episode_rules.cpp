#include "episode/episode_rules.h"

#include <algorithm>
#include <array>
#include <exception>
#include <string>
#include <utility>

#include "base/checks.h"
#include "episode/failure.h"

namespace walker {

EpisodeRules::EpisodeRules(std::unique_ptr<Environment> wrapped)
    : wrapped_(std::move(wrapped)),
      time_limit_reason_(std::to_string(wrapped_->specification().max_episode_steps) + " steps") {}

void EpisodeRules::reset(std::optional<std::uint64_t> seed, Result& result) {
  phase_ = Phase::failed;  // stays so when the reset throws
  steps_ = 0;
  episode_return_ = 0;
  wrapped_->reset(seed, result);
  phase_ = Phase::running;
}

void EpisodeRules::step(const double* action, std::size_t size, Result& result) {
  check_phase();
  check_action(specification(), action, size);
  try {
    wrapped_->step(action, size, result);
  } catch (...) {
    fail(std::current_exception(), result);
    return;
  }
  conclude(result);
}

void EpisodeRules::step_together(StepCall* const* calls, std::size_t count,
                                 std::size_t size) noexcept {
  std::array<StepCall*, kLargestGroup> allowed;  // of `calls`
  std::array<StepCall*, kLargestGroup> wrapped;
  std::size_t num_allowed = 0;
  for (StepCall* const* call = calls; call != calls + count; ++call) {
    auto& rules = static_cast<EpisodeRules&>(*(*call)->environment);
    try {
      rules.check_phase();
      check_action(specification(), (*call)->action, size);
    } catch (...) {
      (*call)->failure = std::current_exception();
      continue;
    }
    rules.wrapped_call_.environment = rules.wrapped_.get();
    rules.wrapped_call_.action = (*call)->action;
    rules.wrapped_call_.result = (*call)->result;
    allowed[num_allowed] = *call;
    wrapped[num_allowed++] = &rules.wrapped_call_;
  }
  if (num_allowed != 0) wrapped_->step_together(wrapped.data(), num_allowed, size);
  for (std::size_t i = 0; i < num_allowed; ++i) {
    auto& rules = static_cast<EpisodeRules&>(*allowed[i]->environment);
    if (rules.wrapped_call_.failure) {
      rules.fail(std::exchange(rules.wrapped_call_.failure, nullptr), *allowed[i]->result);
    } else {
      rules.conclude(*allowed[i]->result);
    }
  }
}

void EpisodeRules::conclude(Result& result) {
  ++steps_;
  episode_return_ += result.reward;
  const std::uint32_t limit = specification().max_episode_steps;
  if (limit != 0 && steps_ >= limit) {
    result.truncated = true;
    if (!result.terminated) result.end_reason = time_limit_reason_.c_str();
  }
  if (result.terminated || result.truncated) phase_ = Phase::ended;
}

void EpisodeRules::fail(const std::exception_ptr& thrown, Result& result) {
  phase_ = Phase::failed;  // there is no state to sense or to step on
  ++steps_;
  error_ = words_of(thrown);
  fail_step(error_.c_str(), specification(), result);
}

void EpisodeRules::sense(Sensors& sensors) {
  need_state_for("sense");
  wrapped_->sense(sensors);
}

void EpisodeRules::scene(Scene& scene) const {
  need_state_for("scene");
  wrapped_->scene(scene);
}

void EpisodeRules::set_coordinates(const std::vector<double>& position,
                                   const std::vector<double>& velocity, Result& result) {
  need_state_for("set_state");
  wrapped_->set_coordinates(position, velocity, result);
  phase_ = Phase::running;
}

std::optional<bool> EpisodeRules::is_healthy() const {
  const std::optional<bool> is_healthy = wrapped_->is_healthy();
  if (is_healthy) need_state_for("is_healthy");
  return is_healthy;
}

struct EpisodeRules::Saved {
  Phase phase = Phase::before_reset;
  Progress progress;
  std::vector<double> observation;
  std::vector<double> info;
  Result result;
  std::string end_reason;
  std::string error;
};

const StateOrigin& EpisodeRules::origin() const {
  if (!origin_) origin_.emplace(specification());
  return *origin_;
}

void EpisodeRules::save_state(const Result& last, std::vector<std::byte>& state) const {
  if (!can_save_state()) return Environment::save_state(last, state);  // throws
  const std::size_t begin = origin().begin(state);
  StateWriter writer(state);
  writer.number(phase_);
  if (phase_ != Phase::before_reset) {
    writer.number(steps_);
    writer.number(episode_return_);
    writer.numbers(last.observation, specification().observation_size());
    writer.numbers(last.info, specification().info_names.size());
    writer.number(last.reward);
    writer.number(std::uint8_t{last.terminated});
    writer.number(std::uint8_t{last.truncated});
    writer.text(last.end_reason);
    writer.text(last.error);
  }
  wrapped_->save_state(last, state);
  StateOrigin::seal(state, begin);
}

Progress EpisodeRules::load_state(const std::byte* state, std::size_t size, Result* last) {
  if (!can_save_state()) return Environment::load_state(state, size, last);  // throws
  StateReader reader = origin().open(state, size);
  Saved saved;
  const auto phase = reader.number<std::uint8_t>();
  if (phase > static_cast<std::uint8_t>(Phase::failed)) {
    refuse_state("its phase is " + std::to_string(phase));
  }
  saved.phase = Phase{phase};
  saved.progress.has_begun = saved.phase != Phase::before_reset;
  if (saved.progress.has_begun) {
    saved.progress.steps = reader.number<std::uint32_t>();
    saved.progress.episode_return = reader.number<double>();
    saved.observation.resize(specification().observation_size());
    saved.info.resize(specification().info_names.size());
    reader.numbers(saved.observation.data(), saved.observation.size());
    reader.numbers(saved.info.data(), saved.info.size());
    saved.result.reward = reader.number<double>();
    saved.result.terminated = reader.flag();
    saved.result.truncated = reader.flag();
    saved.end_reason = reader.text();
    saved.error = reader.text();
  }
  wrapped_->load_state(reader.next(), reader.size(), last);
  if (last == nullptr) return saved.progress;
  // From here on nothing fails.
  phase_ = saved.phase;
  steps_ = saved.progress.steps;
  episode_return_ = saved.progress.episode_return;
  loaded_end_reason_ = std::move(saved.end_reason);
  error_ = std::move(saved.error);
  if (!saved.progress.has_begun) return saved.progress;
  std::copy(saved.observation.begin(), saved.observation.end(), last->observation);
  std::copy(saved.info.begin(), saved.info.end(), last->info);
  saved.result.observation = last->observation;
  saved.result.info = last->info;
  saved.result.end_reason = loaded_end_reason_.c_str();
  saved.result.error = error_.c_str();
  *last = saved.result;
  return saved.progress;
}

void EpisodeRules::check_phase() const {
  need_state_for("step");
  if (phase_ == Phase::ended) {
    throw ResetNeeded("step: the episode ended after " + std::to_string(steps_) +
                      " steps; reset first");
  }
}

void EpisodeRules::need_state_for(const char* call) const {
  if (phase_ == Phase::before_reset) {
    throw ResetNeeded(std::string(call) + ": there is no episode yet; reset first");
  }
  if (phase_ == Phase::failed) {
    throw ResetNeeded(std::string(call) + ": the simulation failed; reset first");
  }
}

}  // namespace walker
