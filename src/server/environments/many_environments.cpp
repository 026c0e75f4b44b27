#include "server/environments/many_environments.h"

#include <algorithm>
#include <stdexcept>

#include "core/random.h"

namespace walker {
namespace {

/// Under same_step the server itself resets, so that topics can tell of the last state before. What
/// is left to the pool's next step are those whose reset failed.
PoolOptions pool_options(const ServerOptions& options) {
  PoolOptions own;
  own.num_envs = options.num_envs;
  own.num_threads = options.num_threads;
  own.autoreset_mode = options.autoreset_mode == AutoresetMode::same_step ? AutoresetMode::next_step
                                                                          : options.autoreset_mode;
  return own;
}

}  // namespace

ManyEnvironments::ManyEnvironments(const ServerOptions& options,
                                   const std::function<std::unique_ptr<Environment>()>& make)
    : pool_(make, pool_options(options)),
      first_seed_(options.seed ? *options.seed : draw_seed()),
      returns_(options.num_envs),
      steps_(options.num_envs) {
  // A first reset without a seed goes on from here, which is as if it were given that seed.
  for (std::size_t i = 0; i < returns_.size(); ++i) {
    pool_.environment(i).set_generator_state(Generator(first_seed_ + i).state());
  }
  state_.environment = options.shown_environment;
}

Simulation& ManyEnvironments::only(const std::string& service) {
  throw std::logic_error(service + ": is for one environment, and this server has num_envs = " +
                         std::to_string(size()) + "; call ~reset_batch and ~step_batch");
}

void ManyEnvironments::reset(const std::vector<std::uint32_t>& environments,
                             const std::vector<std::optional<std::uint64_t>>& seeds,
                             const Batch& rows) {
  for (const std::uint32_t environment : environments) {
    returns_[environment] = 0;
    steps_[environment] = 0;
  }
  const auto shown = std::find(environments.begin(), environments.end(), state_.environment);
  if (shown == environments.end()) {
    pool_.reset(environments, seeds, rows);
    return;
  }
  std::optional<std::uint64_t> seed;
  if (!seeds.empty()) seed = seeds[static_cast<std::size_t>(shown - environments.begin())];
  if (!seed && !has_episode()) seed = first_seed_ + state_.environment;
  const GeneratorState before =
      seed ? Generator(*seed).state() : shown_environment().generator_state();
  pool_.reset(environments, seeds, rows);
  begin_account(seed, before, rows);
}

void ManyEnvironments::step(const std::vector<double>& actions, const Batch& rows) {
  const GeneratorState before = shown_environment().generator_state();
  pool_.step(actions.data(), actions.size(), rows);
  account(actions, before, rows);
}

void ManyEnvironments::account(const std::vector<double>& actions, const GeneratorState& before,
                               const Batch& rows) {
  for (std::size_t i = 0; i < size(); ++i) {
    steps_[i] = rows.steps[i];
    returns_[i] = rows.steps[i] == 0 ? 0 : returns_[i] + rows.rewards[i];
  }
  const std::size_t index = state_.environment;
  if (rows.steps[index] == 0) {
    begin_account(std::nullopt, before, rows);
    return;
  }
  const double* action = actions.data() + index * specification().action_size();
  state_.action.assign(action, action + specification().action_size());
  state_.reward = rows.rewards[index];
  state_.episode_return = returns_[index];
  state_.conclude(rows.terminated[index] != 0, rows.truncated[index] != 0, pool_.end_reason(index),
                  pool_.error(index));
  read_rows(rows);
}

void ManyEnvironments::begin_account(std::optional<std::uint64_t> seed,
                                     const GeneratorState& generator_state, const Batch& rows) {
  state_.action.clear();
  state_.reward = 0;
  state_.episode_return = 0;
  const std::size_t index = state_.environment;
  const char* const error = pool_.reset_error(index);
  state_.conclude(error[0] != '\0', false, pool_.end_reason(index), error);
  state_.seed = seed;
  state_.generator_state = generator_state;
  read_rows(rows);
}

/// What every call writes.
void ManyEnvironments::read_rows(const Batch& rows) {
  const std::size_t index = state_.environment;
  const std::size_t observation_size = specification().observation_size();
  const std::size_t info_size = specification().info_names.size();
  const double* observation = rows.observations + index * observation_size;
  const double* info = rows.info + index * info_size;
  state_.observation.assign(observation, observation + observation_size);
  state_.info.assign(info, info + info_size);
  state_.episode = rows.episodes[index];
  state_.step = rows.steps[index];
  sensors_are_fresh_ = false;
}

const Sensors& ManyEnvironments::sensors() {
  if (!sensors_are_fresh_) {
    shown_environment().sense(sensors_);
    sensors_are_fresh_ = true;
  }
  return sensors_;
}

const Scene& ManyEnvironments::scene() {
  shown_environment().scene(scene_);
  return scene_;
}

}  // namespace walker
