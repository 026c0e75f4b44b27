#include "server/environments/simulation.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <exception>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/failure.h"
#include "core/random.h"

namespace walker {

Simulation::Course::Course(std::unique_ptr<Environment> made) : environment(std::move(made)) {
  const Specification& specification = environment->specification();
  state.observation.resize(specification.observation_size());
  state.info.resize(specification.info_names.size());
  const std::size_t steps = std::min(specification.max_episode_steps, kMostRecordedSteps);
  actions.reserve(steps * specification.action_size());
}

void Simulation::Course::begin(const GeneratorState& generator_state,
                               std::optional<std::uint64_t> seed) {
  environment->set_generator_state(generator_state);
  ++state.episode;
  state.step = 0;
  state.action.clear();
  state.info.assign(state.info.size(), std::numeric_limits<double>::quiet_NaN());
  state.episode_return = 0;
  state.seed = seed;
  state.generator_state = generator_state;
  actions.clear();
  Result result;
  result.observation = state.observation.data();
  result.info = state.info.data();
  std::string error;
  try {
    environment->reset(std::nullopt, result);
  } catch (...) {
    error = words_of(std::current_exception());
    fail_reset(error.c_str(), environment->specification(), result);
  }
  take(result);
}

void Simulation::Course::step(const std::vector<double>& action) {
  Result result;
  result.observation = state.observation.data();
  result.info = state.info.data();
  environment->step(action.data(), action.size(), result);
  ++state.step;
  state.action = action;
  if (state.step <= kMostRecordedSteps) {
    actions.insert(actions.end(), action.begin(), action.end());
  }
  take(result);
}

void Simulation::Course::take(const Result& result) {
  state.reward = result.reward;
  state.episode_return += result.reward;
  state.conclude(result.terminated, result.truncated, result.end_reason, result.error);
}

Simulation::Simulation(const std::function<std::unique_ptr<Environment>()>& make,
                       std::optional<std::uint64_t> first_seed)
    : present_(make()),
      twin_(make()),
      specification_(present_.environment->specification()),
      first_seed_(first_seed ? *first_seed : draw_seed()) {}

void Simulation::reset(std::optional<std::uint64_t> seed) {
  if (!seed && !has_episode()) seed = first_seed_;
  begin(seed ? Generator(*seed).state() : present_.environment->generator_state(), seed);
}

void Simulation::begin(const GeneratorState& state, std::optional<std::uint64_t> seed) {
  present_.begin(state, seed);
  sensors_are_fresh_ = false;
}

void Simulation::step(const std::vector<double>& action) {
  present_.step(action);
  sensors_are_fresh_ = false;
}

EpisodeRecord Simulation::record() const {
  if (!has_episode()) throw std::logic_error("there is no episode yet; reset first");
  if (state().failed_at_reset()) {
    throw std::logic_error(std::string("there is no episode: ") + kResetFailed + "; reset first");
  }
  if (state().step > kMostRecordedSteps) {
    throw std::logic_error("the episode has " + std::to_string(state().step) +
                           " steps; the record was given up after " +
                           std::to_string(kMostRecordedSteps));
  }
  EpisodeRecord record = describe_origin(specification_);
  record.seed = state().seed;
  record.generator_state = state().generator_state;
  record.num_steps = state().step;
  record.actions = present_.actions;
  record.episode_return = state().episode_return;
  check_repeatable(record, specification_);
  return record;
}

void Simulation::restore(EpisodeRecord record) {
  begin_restore(std::move(record));
  while (!go_on_restoring(std::chrono::steady_clock::time_point::max())) {
  }
  finish_restore();
}

/// In the twin: the present episode stays as it is when the record turns out wrong.
void Simulation::begin_restore(EpisodeRecord record) {
  check_repeatable(record, specification_);
  if (record.num_steps > kMostRecordedSteps) {
    throw std::invalid_argument("the record has " + std::to_string(record.num_steps) +
                                " steps; must have at most " + std::to_string(kMostRecordedSteps));
  }
  twin_.begin(record.generator_state, record.seed);
  if (twin_.state.failed_at_reset()) {
    throw std::invalid_argument("the reset of the record: " + twin_.state.error);
  }
  restored_ = std::move(record);
}

bool Simulation::go_on_restoring(std::chrono::steady_clock::time_point until) {
  const std::size_t size = specification_.action_size();
  std::vector<double> action(size);
  while (twin_.state.step < restored_.num_steps) {
    const std::uint32_t step = twin_.state.step;
    std::copy_n(restored_.actions.begin() + static_cast<std::ptrdiff_t>(step * size), size,
                action.begin());
    try {
      twin_.step(action);
    } catch (const std::exception& error) {
      throw std::invalid_argument("step " + std::to_string(step + 1) +
                                  " of the record: " + error.what());
    }
    if (std::chrono::steady_clock::now() >= until) break;
  }
  if (twin_.state.step < restored_.num_steps) return false;
  if (twin_.state.episode_return != restored_.episode_return) {
    throw std::invalid_argument("episode_return = " + to_string(restored_.episode_return) +
                                " in the record; repeated here it is " +
                                to_string(twin_.state.episode_return));
  }
  return true;
}

void Simulation::finish_restore() {
  twin_.state.episode = state().episode + 1;
  std::swap(present_, twin_);
  restored_ = {};
  sensors_are_fresh_ = false;
}

const Sensors& Simulation::sensors() {
  if (!sensors_are_fresh_) {
    present_.environment->sense(sensors_);
    sensors_are_fresh_ = true;
  }
  return sensors_;
}

const Scene& Simulation::scene() {
  present_.environment->scene(scene_);
  return scene_;
}

}  // namespace walker
