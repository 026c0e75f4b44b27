#include "server/batch_calls.h"

#include <cstddef>
#include <numeric>
#include <stdexcept>
#include <type_traits>

#include <ros/console.h>

#include "server/topics/effort_command.h"

namespace walker {
namespace {

std::string element(const char* field, std::size_t index) {
  return std::string(field) + "[" + std::to_string(index) + "]";
}

void append(const std::vector<double>& row, std::vector<double>& rows) {
  rows.insert(rows.end(), row.begin(), row.end());
}

std::vector<std::optional<std::uint64_t>> seeds_of(const walker_sim::ResetBatch::Request& request) {
  std::vector<std::optional<std::uint64_t>> seeds(request.seeds.size());
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    if (request.has_seed[i] != 0) seeds[i] = request.seeds[i];
  }
  return seeds;
}

}  // namespace

BatchCalls::BatchCalls(Pool& pool, const ServerOptions& options, ServerCounters& counters,
                       EpisodeStatistics& episodes)
    : pool_(pool),
      specification_(pool.specification()),
      options_(options),
      counters_(counters),
      episodes_(episodes),
      all_(pool.options().num_envs) {
  std::iota(all_.begin(), all_.end(), 0U);
}

void BatchCalls::reset(const walker_sim::ResetBatch::Request& request,
                       walker_sim::ResetBatch::Response& response) {
  response.observations.clear();
  response.info.clear();
  response.status_message.clear();
  response.failed_environments.clear();
  response.failures.clear();
  check(request);
  const std::vector<std::uint32_t>& listed =
      request.environments.empty() ? all_ : request.environments;
  pool_.reset(listed, seeds_of(request), {});
  counters_.resets += listed.size();
  for (const std::uint32_t environment : listed) {
    const EpisodeState& state = state_of(environment);
    if (state.failed_at_reset()) record_failure(state, response);
    append(state.observation, response.observations);
    append(state.info, response.info);
  }
}

void BatchCalls::check(const walker_sim::ResetBatch::Request& request) const {
  const std::vector<std::uint32_t>& listed = request.environments;
  std::vector<bool> is_listed(all_.size());
  for (std::size_t i = 0; i < listed.size(); ++i) {
    check_environment(pool_, element("environments", i), listed[i]);
    if (is_listed[listed[i]]) {
      throw std::invalid_argument(element("environments", i) + " = " + std::to_string(listed[i]) +
                                  "; is listed before, and each may be listed once");
    }
    is_listed[listed[i]] = true;
  }
  const std::size_t count = listed.empty() ? all_.size() : listed.size();
  const std::size_t seeds = request.seeds.size();
  if (request.has_seed.size() != seeds || (seeds != 0 && seeds != count)) {
    throw std::invalid_argument("has_seed has " + std::to_string(request.has_seed.size()) +
                                " values and seeds " + std::to_string(seeds) +
                                "; both must be empty or have " + std::to_string(count) +
                                ", one per environment to reset");
  }
}

void BatchCalls::step(const std::vector<double>& actions,
                      walker_sim::StepBatch::Response& response) {
  response.failed_environments.clear();
  response.failed_at_reset.clear();
  response.failures.clear();
  response.final_environments.clear();
  response.final_observations.clear();
  response.final_info.clear();
  response.status_message.clear();
  pool_.step(actions.data(), actions.size(), rows_of(response));
  account(actions, response);
}

/// Resizes the response's vectors and returns pointers to their elements.
Batch BatchCalls::rows_of(walker_sim::StepBatch::Response& response) const {
  const std::size_t size = all_.size();
  response.observations.resize(size * specification_.observation_size());
  response.rewards.resize(size);
  response.terminated.resize(size);
  response.truncated.resize(size);
  response.episodes.resize(size);
  response.steps.resize(size);
  response.info.resize(size * specification_.info_names.size());
  Batch rows;
  rows.observations = response.observations.data();
  rows.rewards = response.rewards.data();
  rows.terminated = response.terminated.data();
  rows.truncated = response.truncated.data();
  rows.episodes = response.episodes.data();
  rows.steps = response.steps.data();
  rows.info = response.info.data();
  return rows;
}

/// Counts the step's outcomes and lists the episodes that it ended.
void BatchCalls::account(const std::vector<double>& actions,
                         walker_sim::StepBatch::Response& response) {
  ended_.clear();
  for (const std::uint32_t environment : all_) {
    const EpisodeState& state = state_of(environment);
    const bool has_ended =
        response.terminated[environment] != 0 || response.truncated[environment] != 0;
    if (response.steps[environment] == 0) {
      ++counters_.resets;
      if (has_ended) record_failure(state, response);
    } else {
      ++counters_.steps;
      const double* action = actions.data() + environment * specification_.action_size();
      if (is_clamped(specification_, action)) ++counters_.clamped_commands;
      if (has_ended) {
        if (!state.error.empty()) record_failure(state, response);
        episodes_.add(state);
        ended_.push_back(environment);
      }
    }
    if (has_ended && options_.autoreset_mode == AutoresetMode::same_step) {
      response.final_environments.push_back(environment);
      append(state.observation, response.final_observations);
      append(state.info, response.final_info);
    }
  }
}

template <typename Response>
void BatchCalls::record_failure(const EpisodeState& state, Response& response) {
  ++counters_.simulation_errors;
  const std::string text = std::to_string(state.environment) + ": " +
                           (state.failed_at_reset() ? kResetFailed : kStepFailed) + ": " +
                           state.error;
  if (throttle_.passes()) ROS_ERROR_STREAM("Environment " << text);
  if (!response.status_message.empty()) response.status_message += '\n';
  response.status_message += "environment " + text;
  response.failed_environments.push_back(state.environment);
  response.failures.push_back(state.error);
  if constexpr (std::is_same_v<Response, walker_sim::StepBatch::Response>) {
    response.failed_at_reset.push_back(state.failed_at_reset() ? 1 : 0);
  }
}

void BatchCalls::reset_ended(walker_sim::StepBatch::Response& response) {
  if (options_.autoreset_mode != AutoresetMode::same_step || ended_.empty()) return;
  Batch rows = rows_of(response);
  rows.rewards = nullptr;  // these keep the values of the last step
  rows.terminated = nullptr;
  rows.truncated = nullptr;
  pool_.reset(ended_, {}, rows);
  counters_.resets += ended_.size();
  for (const std::uint32_t environment : ended_) {
    const EpisodeState& state = state_of(environment);
    if (state.failed_at_reset()) record_failure(state, response);
  }
}

}  // namespace walker
