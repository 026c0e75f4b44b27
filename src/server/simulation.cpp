#include "server/simulation.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

#include "core/random.h"

namespace walker {

Simulation::Simulation(MakeEnvironment make, std::optional<std::uint64_t> first_seed)
    : make_(std::move(make)),
      environment_(make_()),
      specification_(environment_->specification()),
      first_seed_(first_seed ? *first_seed : draw_seed()) {
  state_.observation.resize(specification_.observation_size());
  state_.info.resize(specification_.info_names.size());
  const std::size_t steps = std::min(specification_.max_episode_steps, kMostRecordedSteps);
  actions_.reserve(steps * specification_.action_size());
}

void Simulation::reset(std::optional<std::uint64_t> seed) {
  if (!seed && !has_episode()) seed = first_seed_;
  begin(seed ? Generator(*seed).state() : environment_->generator_state(), seed);
}

void Simulation::begin(const GeneratorState& state, std::optional<std::uint64_t> seed) {
  environment_->set_generator_state(state);
  state_.info.assign(state_.info.size(), std::numeric_limits<double>::quiet_NaN());
  Result result;
  result.observation = state_.observation.data();
  result.info = state_.info.data();
  environment_->reset(std::nullopt, result);
  ++state_.episode;
  state_.step = 0;
  state_.action.clear();
  state_.episode_return = 0;
  state_.seed = seed;
  state_.generator_state = state;
  actions_.clear();
  take(result);
}

void Simulation::step(const std::vector<double>& action) {
  Result result;
  result.observation = state_.observation.data();
  result.info = state_.info.data();
  environment_->step(action.data(), action.size(), result);
  ++state_.step;
  state_.action = action;
  if (state_.step <= kMostRecordedSteps) {
    actions_.insert(actions_.end(), action.begin(), action.end());
  }
  take(result);
}

void Simulation::take(const Result& result) {
  state_.reward = result.reward;
  state_.episode_return += result.reward;
  state_.terminated = result.terminated;
  state_.truncated = result.truncated;
  state_.error = result.error;
  state_.end_reason.clear();
  if (result.terminated) {
    state_.end_reason = std::string("terminated: ") + result.end_reason;
  } else if (result.truncated) {
    state_.end_reason = std::string("truncated: ") + result.end_reason;
  }
  sensors_are_fresh_ = false;
}

EpisodeRecord Simulation::record() const {
  if (!has_episode()) throw std::logic_error("there is no episode yet; reset first");
  if (state_.step > kMostRecordedSteps) {
    throw std::logic_error("the episode has " + std::to_string(state_.step) +
                           " steps; the record was given up after " +
                           std::to_string(kMostRecordedSteps));
  }
  EpisodeRecord record = describe_origin(specification_);
  record.seed = state_.seed;
  record.generator_state = state_.generator_state;
  record.actions = actions_;
  record.episode_return = state_.episode_return;
  check_repeatable(record, specification_);
  return record;
}

void Simulation::restore(const EpisodeRecord& record) {
  check_repeatable(record, specification_);
  // Played beside the present episode, which stays as it is when the record turns out wrong.
  Simulation twin(make_, first_seed_);
  twin.begin(record.generator_state, record.seed);
  const std::size_t size = specification_.action_size();
  std::vector<double> action(size);
  for (std::size_t first = 0; first < record.actions.size(); first += size) {
    std::copy_n(record.actions.begin() + static_cast<std::ptrdiff_t>(first), size, action.begin());
    twin.step(action);
  }
  if (twin.state_.episode_return != record.episode_return) {
    throw std::invalid_argument("episode_return = " + to_string(record.episode_return) +
                                " in the record; repeated here it is " +
                                to_string(twin.state_.episode_return));
  }
  twin.state_.episode = state_.episode + 1;
  environment_ = std::move(twin.environment_);
  state_ = std::move(twin.state_);
  actions_ = std::move(twin.actions_);
  sensors_are_fresh_ = false;
}

const Sensors& Simulation::sensors() {
  if (!sensors_are_fresh_) {
    environment_->sense(sensors_);
    sensors_are_fresh_ = true;
  }
  return sensors_;
}

const Scene& Simulation::scene() {
  environment_->scene(scene_);
  return scene_;
}

}  // namespace walker
