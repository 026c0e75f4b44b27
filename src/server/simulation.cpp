#include "server/simulation.h"

#include <limits>
#include <utility>

#include "core/random.h"

namespace walker {

Simulation::Simulation(std::unique_ptr<Environment> environment,
                       std::optional<std::uint64_t> first_seed)
    : environment_(std::move(environment)), first_seed_(first_seed ? *first_seed : draw_seed()) {
  state_.observation.resize(specification().observation_size());
  state_.info.resize(specification().info_names.size());
}

void Simulation::reset(std::optional<std::uint64_t> seed) {
  if (!seed && !has_episode()) seed = first_seed_;
  const GeneratorState before = seed ? Generator(*seed).state() : environment_->generator_state();
  state_.info.assign(state_.info.size(), std::numeric_limits<double>::quiet_NaN());
  Result result;
  result.observation = state_.observation.data();
  result.info = state_.info.data();
  environment_->reset(seed, result);
  ++state_.episode;
  state_.step = 0;
  state_.action.clear();
  state_.episode_return = 0;
  state_.seed = seed;
  state_.generator_state = before;
  record(result);
}

void Simulation::step(const std::vector<double>& action) {
  Result result;
  result.observation = state_.observation.data();
  result.info = state_.info.data();
  environment_->step(action.data(), action.size(), result);
  ++state_.step;
  state_.action = action;
  record(result);
}

void Simulation::record(const Result& result) {
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
