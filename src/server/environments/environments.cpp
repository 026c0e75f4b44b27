#include "server/environments/environments.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "base/checks.h"
#include "base/random.h"

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

template <typename From, typename To>
void write(const From* values, std::size_t size, To* to) {
  if (to != nullptr) std::copy_n(values, size, to);
}

}  // namespace

Environments::Environments(ServerOptions options, const MakeEnvironment& make)
    : options_(std::move(options)) {
  if (!options_.seed) options_.seed = draw_seed();
  if (options_.num_envs == 1) {
    only_ = record(make());
  } else {
    pool_.emplace([&] { return record(make()); }, pool_options(options_));
  }
}

std::unique_ptr<EpisodeRecorder> Environments::record(std::unique_ptr<Environment> environment) {
  RecorderOptions recorder;
  recorder.environment = static_cast<std::uint32_t>(recorders_.size());
  recorder.first_seed = *options_.seed + recorder.environment;
  recorder.keeps_actions = options_.num_envs == 1;
  auto recorded = std::make_unique<EpisodeRecorder>(std::move(environment), recorder);
  recorders_.push_back(recorded.get());
  return recorded;
}

EpisodeRecorder& Environments::only(const std::string& service) const {
  if (only_) return *only_;
  throw std::logic_error(service + ": is for one environment, and this server has num_envs = " +
                         std::to_string(size()) + "; call ~reset_batch and ~step_batch");
}

void Environments::check_index(const std::string& field, std::uint32_t index) const {
  if (index < size()) return;
  throw std::invalid_argument(field + " = " + std::to_string(index) +
                              "; must be below num_envs = " + std::to_string(size()));
}

void Environments::reset(const std::vector<std::uint32_t>& environments,
                         const std::vector<std::optional<std::uint64_t>>& seeds,
                         const Batch& rows) {
  if (pool_) {
    pool_->reset(environments, seeds, rows);
    return;
  }
  only_->reset(seeds.empty() ? std::nullopt : seeds.front());
  write_only(rows);
}

void Environments::step(const std::vector<double>& actions, const Batch& rows) {
  if (pool_) {
    pool_->step(actions.data(), actions.size(), rows);
    return;
  }
  if (only_is_reset_by_step()) {
    check_action(specification(), actions.data(), actions.size());  // though ignored
    only_->reset(std::nullopt);
  } else {
    only_->step(actions);
  }
  write_only(rows);
}

bool Environments::only_is_reset_by_step() const {
  const EpisodeState& state = only_->state();
  if (options_.autoreset_mode == AutoresetMode::next_step) return state.has_ended();
  return options_.autoreset_mode == AutoresetMode::same_step && state.failed_at_reset();
}

void Environments::write_only(const Batch& rows) const {
  const EpisodeState& state = only_->state();
  write(state.observation.data(), state.observation.size(), rows.observations);
  write(state.info.data(), state.info.size(), rows.info);
  write(&state.reward, 1, rows.rewards);
  write(&state.terminated, 1, rows.terminated);
  write(&state.truncated, 1, rows.truncated);
  write(&state.episode, 1, rows.episodes);
  write(&state.step, 1, rows.steps);
}

}  // namespace walker
