#include "core/episode_rules.h"

#include <array>
#include <exception>
#include <string>
#include <utility>

#include "core/checks.h"
#include "core/failure.h"

namespace walker {

EpisodeRules::EpisodeRules(std::unique_ptr<Environment> wrapped)
    : wrapped_(std::move(wrapped)),
      time_limit_reason_(std::to_string(wrapped_->specification().max_episode_steps) + " steps") {}

void EpisodeRules::reset(std::optional<std::uint64_t> seed, Result& result) {
  phase_ = Phase::failed;  // stays so when the reset throws
  wrapped_->reset(seed, result);
  phase_ = Phase::running;
  steps_ = 0;
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
  const std::uint32_t limit = specification().max_episode_steps;
  if (limit != 0 && steps_ >= limit) {
    result.truncated = true;
    if (!result.terminated) result.end_reason = time_limit_reason_.c_str();
  }
  if (result.terminated || result.truncated) phase_ = Phase::ended;
}

void EpisodeRules::fail(const std::exception_ptr& thrown, Result& result) {
  phase_ = Phase::failed;  // there is no state to sense or to step on
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
