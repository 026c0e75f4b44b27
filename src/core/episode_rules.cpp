#include "core/episode_rules.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <string>
#include <utility>

namespace walker {

EpisodeRules::EpisodeRules(std::unique_ptr<Environment> wrapped)
    : wrapped_(std::move(wrapped)),
      time_limit_reason_(std::to_string(wrapped_->specification().max_episode_steps) + " steps") {}

void EpisodeRules::reset(std::optional<std::uint64_t> seed, Result& result) {
  phase_ = Phase::before_reset;  // stays so when the reset throws
  wrapped_->reset(seed, result);
  phase_ = Phase::running;
  steps_ = 0;
}

void EpisodeRules::step(const double* action, std::size_t size, Result& result) {
  check_phase();
  check_action(action, size);
  try {
    wrapped_->step(action, size, result);
  } catch (const std::exception& error) {
    fail(error, result);
    return;
  }
  ++steps_;
  const std::uint32_t limit = specification().max_episode_steps;
  if (limit != 0 && steps_ >= limit) {
    result.truncated = true;
    if (!result.terminated) result.end_reason = time_limit_reason_.c_str();
  }
  if (result.terminated || result.truncated) phase_ = Phase::ended;
}

void EpisodeRules::fail(const std::exception& error, Result& result) {
  phase_ = Phase::failed;  // there is no state to sense or to step on
  error_ = error.what();
  std::fill_n(result.info, specification().info_names.size(),
              std::numeric_limits<double>::quiet_NaN());  // absent
  result.reward = 0;
  result.terminated = true;
  result.truncated = false;
  result.end_reason = "the simulation failed";
  result.error = error_.c_str();
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

void EpisodeRules::check_action(const double* action, std::size_t size) const {
  const std::size_t expected = specification().action_size();
  if (size != expected) {
    throw InvalidAction("action has " + std::to_string(size) + " values; must have " +
                        std::to_string(expected) + ", one per joint");
  }
  for (std::size_t i = 0; i < size; ++i) {
    if (!std::isfinite(action[i])) {
      throw InvalidAction("action[" + std::to_string(i) + "] (" + specification().joints[i].name +
                          ") = " + std::to_string(action[i]) + "; must be finite");
    }
  }
}

}  // namespace walker
