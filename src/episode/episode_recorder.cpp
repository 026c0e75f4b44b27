#include "episode/episode_recorder.h"

#include <algorithm>
#include <array>
#include <exception>
#include <stdexcept>
#include <utility>

#include "episode/failure.h"
#include "base/random.h"

namespace walker {
namespace {

void copy_row(const double* from, std::vector<double>& to) {
  if (from != to.data()) std::copy_n(from, to.size(), to.begin());
}

}  // namespace

EpisodeRecorder::EpisodeRecorder(std::unique_ptr<Environment> wrapped, RecorderOptions options)
    : wrapped_(std::move(wrapped)), options_(options) {
  state_.environment = options_.environment;
  state_.observation.resize(specification().observation_size());
  state_.info.resize(specification().info_names.size());
  if (!options_.keeps_actions) return;
  const std::size_t steps = std::min(specification().max_episode_steps, kMostRecordedSteps);
  actions_.reserve(steps * specification().action_size());
}

Result EpisodeRecorder::own_result() {
  Result result;
  result.observation = state_.observation.data();
  result.info = state_.info.data();
  return result;
}

void EpisodeRecorder::reset(std::optional<std::uint64_t> seed) {
  Result result = own_result();
  start(seed, result);
}

void EpisodeRecorder::reset(std::optional<std::uint64_t> seed, Result& result) {
  start(seed, result);
  if (state_.failed_at_reset()) throw std::runtime_error(state_.error);
}

void EpisodeRecorder::start(std::optional<std::uint64_t> seed, Result& result) {
  if (!seed && !has_episode()) seed = options_.first_seed;
  const GeneratorState before = seed ? Generator(*seed).state() : wrapped_->generator_state();
  if (seed) wrapped_->set_generator_state(before);
  start(before, seed, result);
}

void EpisodeRecorder::begin(const GeneratorState& generator_state,
                            std::optional<std::uint64_t> seed) {
  wrapped_->set_generator_state(generator_state);
  Result result = own_result();
  start(generator_state, seed, result);
}

/// From where the generator is.
void EpisodeRecorder::start(const GeneratorState& generator_state,
                            std::optional<std::uint64_t> seed, Result& result) {
  ++state_.episode;
  state_.step = 0;
  state_.action.clear();
  state_.episode_return = 0;
  state_.seed = seed;
  state_.generator_state = generator_state;
  actions_.clear();
  was_loaded_ = false;
  const std::string error = try_reset(*wrapped_, std::nullopt, result);
  take(result);
  state_.error = error;
}

void EpisodeRecorder::step(const double* action, std::size_t size) {
  Result result = own_result();
  step(action, size, result);
}

void EpisodeRecorder::step(const double* action, std::size_t size, Result& result) {
  wrapped_->step(action, size, result);
  take_step(action, size, result);
}

void EpisodeRecorder::step_together(StepCall* const* calls, std::size_t count,
                                    std::size_t size) noexcept {
  std::array<StepCall*, kLargestGroup> wrapped;
  std::size_t num_wrapped = 0;
  for (StepCall* const* call = calls; call != calls + count; ++call) {
    auto& recorder = static_cast<EpisodeRecorder&>(*(*call)->environment);
    recorder.wrapped_call_.environment = recorder.wrapped_.get();
    recorder.wrapped_call_.action = (*call)->action;
    recorder.wrapped_call_.result = (*call)->result;
    wrapped[num_wrapped++] = &recorder.wrapped_call_;
  }
  if (num_wrapped != 0) wrapped_->step_together(wrapped.data(), num_wrapped, size);
  for (StepCall* const* call = calls; call != calls + count; ++call) {
    auto& recorder = static_cast<EpisodeRecorder&>(*(*call)->environment);
    (*call)->failure = std::exchange(recorder.wrapped_call_.failure, nullptr);
    if (!(*call)->failure) recorder.take_step((*call)->action, size, *(*call)->result);
  }
}

void EpisodeRecorder::take_step(const double* action, std::size_t size, const Result& result) {
  ++state_.step;
  state_.action.assign(action, action + size);
  if (options_.keeps_actions && !was_loaded_ && state_.step <= kMostRecordedSteps) {
    actions_.insert(actions_.end(), action, action + size);
  } else if (!actions_.empty()) {
    actions_ = {};
  }
  take(result);
}

void EpisodeRecorder::take(const Result& result) {
  copy_row(result.observation, state_.observation);
  copy_row(result.info, state_.info);
  state_.reward = result.reward;
  state_.episode_return += result.reward;
  state_.terminated = result.terminated;
  state_.truncated = result.truncated;
  state_.end_reason.clear();
  if (state_.has_ended()) {
    state_.end_reason.append(result.terminated ? "terminated: " : "truncated: ");
    state_.end_reason.append(result.end_reason);
  }
  state_.error = result.error;
  sensors_are_fresh_ = false;
}

const Sensors& EpisodeRecorder::sensors() {
  if (!sensors_are_fresh_) {
    wrapped_->sense(sensors_);
    sensors_are_fresh_ = true;
  }
  return sensors_;
}

const Scene& EpisodeRecorder::scene() {
  wrapped_->scene(scene_);
  return scene_;
}

EpisodeRecord EpisodeRecorder::record() const {
  if (!has_episode()) throw std::logic_error("there is no episode yet; reset first");
  if (state_.failed_at_reset()) {
    throw std::logic_error(std::string("there is no episode: ") + kResetFailed + "; reset first");
  }
  if (was_loaded_) {
    throw std::logic_error(
        "the episode goes on from a saved state; how it came there is not known");
  }
  if (state_.step > kMostRecordedSteps) {
    throw std::logic_error("the episode has " + std::to_string(state_.step) +
                           " steps; the record was given up after " +
                           std::to_string(kMostRecordedSteps));
  }
  EpisodeRecord record = describe_origin(specification());
  record.seed = state_.seed;
  record.generator_state = state_.generator_state;
  record.num_steps = state_.step;
  record.actions = actions_;
  record.episode_return = state_.episode_return;
  check_repeatable(record, specification());
  return record;
}

void EpisodeRecorder::begin(const EpisodeRecord& record) {
  check_repeatable(record, specification());
  if (record.num_steps > kMostRecordedSteps) {
    throw std::invalid_argument("the record has " + std::to_string(record.num_steps) +
                                " steps; must have at most " + std::to_string(kMostRecordedSteps));
  }
  begin(record.generator_state, record.seed);
  if (state_.failed_at_reset()) {
    throw std::invalid_argument("the reset of the record: " + state_.error);
  }
}

bool EpisodeRecorder::repeat(const std::vector<double>& actions,
                             std::chrono::steady_clock::time_point until) {
  const std::size_t size = specification().action_size();
  const std::size_t num_steps = actions.size() / size;
  while (state_.step < num_steps) {
    try {
      step(&actions[state_.step * size], size);
    } catch (const std::exception& error) {
      throw std::invalid_argument("step " + std::to_string(state_.step + 1) +
                                  " of the record: " + error.what());
    }
    if (std::chrono::steady_clock::now() >= until) break;
  }
  return state_.step >= num_steps;
}

bool EpisodeRecorder::repeat(const EpisodeRecord& record,
                             std::chrono::steady_clock::time_point until) {
  if (!repeat(record.actions, until)) return false;
  if (state_.episode_return != record.episode_return) {
    throw std::invalid_argument("episode_return = " + to_string(record.episode_return) +
                                " in the record; repeated here it is " +
                                to_string(state_.episode_return));
  }
  return true;
}

void EpisodeRecorder::save_state(std::vector<std::byte>& state) {
  Result last = own_result();
  last.reward = state_.reward;
  last.terminated = state_.terminated;
  last.truncated = state_.truncated;
  // Without "terminated: ".
  if (state_.has_ended()) last.end_reason = &state_.end_reason[state_.end_reason.find(": ") + 2];
  last.error = state_.error.c_str();
  wrapped_->save_state(last, state);
}

void EpisodeRecorder::load_state(const std::byte* state, std::size_t size) {
  Result result = own_result();
  load_state(state, size, &result);
}

Progress EpisodeRecorder::load_state(const std::byte* state, std::size_t size, Result* last) {
  const Progress progress = wrapped_->load_state(state, size, last);
  if (last == nullptr) return progress;
  state_.episode = progress.has_begun ? state_.episode + 1 : 0;
  state_.step = progress.steps;
  state_.action.clear();
  state_.seed.reset();
  state_.generator_state = {};
  actions_.clear();
  was_loaded_ = progress.has_begun;
  if (!progress.has_begun) {
    std::fill(state_.observation.begin(), state_.observation.end(), 0);
    std::fill(state_.info.begin(), state_.info.end(), 0);
    *last = {last->observation, last->info};
  }
  take(*last);
  state_.episode_return = progress.episode_return;  // with the last reward
  return progress;
}

void EpisodeRecorder::set_coordinates(const std::vector<double>& position,
                                      const std::vector<double>& velocity) {
  Result result = own_result();
  set_coordinates(position, velocity, result);
}

void EpisodeRecorder::set_coordinates(const std::vector<double>& position,
                                      const std::vector<double>& velocity, Result& result) {
  wrapped_->set_coordinates(position, velocity, result);
  actions_.clear();
  was_loaded_ = true;
  take(result);
}

void EpisodeRecorder::take_over(EpisodeRecorder& other) {
  other.state_.episode = other.has_episode() ? state_.episode + 1 : 0;
  std::swap(wrapped_, other.wrapped_);
  std::swap(state_, other.state_);
  std::swap(actions_, other.actions_);
  std::swap(was_loaded_, other.was_loaded_);
  sensors_are_fresh_ = false;
}

}  // namespace walker
