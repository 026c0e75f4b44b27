#include "server/batch_calls.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <stdexcept>
#include <type_traits>

#include <ros/console.h>

#include "base/random.h"
#include "ros/message_conversions.h"
#include "server/topics/commands.h"
#include "server/topics/converters.h"

namespace walker {
namespace {

std::string element(const char* field, std::size_t index) {
  return std::string(field) + "[" + std::to_string(index) + "]";
}

template <typename... Fields>
void clear(Fields&... fields) {
  (fields.clear(), ...);
}

void append(const std::vector<double>& row, std::vector<double>& rows) {
  rows.insert(rows.end(), row.begin(), row.end());
}

std::vector<std::optional<std::uint64_t>> seeds_of(const ResetBatch::Request& request) {
  std::vector<std::optional<std::uint64_t>> seeds(request.seeds.size());
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    if (request.has_seed[i] != 0) seeds[i] = request.seeds[i];
  }
  return seeds;
}

/// Appends what the episode has drawn, unless it is in Gymnasium's world.
void append_world(const EpisodeState& state, std::vector<walker_sim::EnvironmentWorld>& worlds) {
  if (!state.world) return;
  walker_sim::EnvironmentWorld& message = worlds.emplace_back();
  message.environment = state.environment;
  to_message(*state.world, message.parameters);
}

}  // namespace

Pool make_pool(const ServerOptions& options, const MakeEnvironment& make) {
  PoolOptions pool_options;
  pool_options.num_envs = options.num_envs;
  pool_options.num_threads = std::min(options.num_threads, options.num_envs);
  pool_options.autoreset_mode = options.autoreset_mode;
  const std::uint64_t seed = options.seed ? *options.seed : draw_seed();
  std::shared_ptr<const CheckedWorld> world;  // shared by all
  std::uint32_t index = 0;
  const auto make_walker = [&] {
    std::unique_ptr<Environment> environment = make();
    WalkerOptions own;
    own.records_actions = index == options.shown_environment;
    own.first_seed = seed + index++;
    if (!world) world = CheckedWorld::share(environment->specification(), options.world);
    walker_of(*environment).configure(own);
    walker_of(*environment).set_world(world);
    return environment;
  };
  return {make_walker, pool_options};
}

Walker& single_walker(Pool& pool, const char* service) {
  if (pool.options().num_envs == 1) return pool.walker(0);
  throw std::logic_error(
      std::string(service) + ": is for one environment, and this server has num_envs = " +
      std::to_string(pool.options().num_envs) + "; call ~reset_batch and ~step_batch");
}

void check_environment(const Pool& pool, const std::string& field, std::uint32_t index) {
  const std::size_t num_envs = pool.options().num_envs;
  if (index < num_envs) return;
  throw std::invalid_argument(field + " = " + std::to_string(index) +
                              "; must be below num_envs = " + std::to_string(num_envs));
}

walker_sim::GetWorlds::Response list_worlds(const ServerOptions& options,
                                            const Specification& specification) {
  walker_sim::GetWorlds::Response response;
  to_message(options.world, response.launch);
  for (const std::string& preset : world_presets()) {
    try {
      CheckedWorld::share(specification, load_world(preset));
      response.presets.push_back(preset);
      // NOLINTNEXTLINE(bugprone-empty-catch): it cannot be applied
    } catch (const std::invalid_argument&) {
    }
  }
  for (const WorldParameter& parameter : world_parameters(specification.id)) {
    const auto& refused = specification.inapplicable_world_parameters;
    const bool is_refused = std::any_of(refused.begin(), refused.end(), [&](const auto& each) {
      return each.first == parameter.name;
    });
    if (!is_refused) response.parameters.push_back(parameter.name);
  }
  return response;
}

BatchCalls::BatchCalls(Pool& pool, const ServerOptions& options, Account& account)
    : pool_(pool),
      specification_(pool.specification()),
      options_(options),
      account_(account),
      all_(pool.options().num_envs) {
  std::iota(all_.begin(), all_.end(), 0U);
  ended_.reserve(all_.size());
}

void BatchCalls::reset(const ResetBatch::Request& request, ResetBatch::Response& response) {
  clear(response.observations, response.info, response.status_message, response.failed_environments,
        response.failures, response.worlds);
  check_list(request.environments);
  const std::vector<std::uint32_t>& listed =
      request.environments.empty() ? all_ : request.environments;
  const std::size_t seeds = request.seeds.size();
  if (request.has_seed.size() != seeds || (seeds != 0 && seeds != listed.size())) {
    throw std::invalid_argument("has_seed has " + std::to_string(request.has_seed.size()) +
                                " values and seeds " + std::to_string(seeds) +
                                "; both must be empty or have " + std::to_string(listed.size()) +
                                ", one per environment to reset");
  }
  if (!request.worlds.empty()) set_requested(listed, request.worlds);
  pool_.reset(listed, seeds_of(request), {});
  for (const std::uint32_t environment : listed) {
    const EpisodeState& state = state_of(environment);
    append(state.observation, response.observations);
    append(state.info, response.info);
    record(state, response);
  }
}

void BatchCalls::set_worlds(const SetWorld::Request& request) {
  check_list(request.environments);
  const std::vector<std::uint32_t>& listed =
      request.environments.empty() ? all_ : request.environments;
  for (std::size_t i = 0; i < request.worlds.size(); ++i) {
    const walker_sim::World& world = request.worlds[i];
    if (!world.preset.empty() || !world.parameters.empty()) continue;
    throw std::invalid_argument(element("worlds", i) +
                                " is empty; must have a preset or parameters (Gymnasium's world is "
                                "the preset gymnasium)");
  }
  set_requested(listed, request.worlds);
}

/// Sets the worlds that are not empty.
/// @param worlds one for all, or one per listed environment
void BatchCalls::set_requested(const std::vector<std::uint32_t>& listed,
                               const std::vector<walker_sim::World>& worlds) {
  if (worlds.size() != 1 && worlds.size() != listed.size()) {
    throw std::invalid_argument("worlds has " + std::to_string(worlds.size()) +
                                " values; must have 1 for all, or " +
                                std::to_string(listed.size()) + ", one per environment");
  }
  std::vector<std::uint32_t> changed;
  std::vector<World> requested;
  for (std::size_t i = 0; i < worlds.size(); ++i) {
    const std::optional<World> world = to_world(worlds[i]);
    if (!world) continue;
    changed.push_back(listed[i]);
    requested.push_back(*world);
  }
  if (requested.empty()) return;
  pool_.set_world(worlds.size() == 1 ? listed : changed, requested);
}

void BatchCalls::check_list(const std::vector<std::uint32_t>& listed) const {
  std::vector<bool> is_listed(all_.size());
  for (std::size_t i = 0; i < listed.size(); ++i) {
    check_environment(pool_, element("environments", i), listed[i]);
    if (is_listed[listed[i]]) {
      throw std::invalid_argument(element("environments", i) + " = " + std::to_string(listed[i]) +
                                  "; must be listed once only");
    }
    is_listed[listed[i]] = true;
  }
}

void BatchCalls::step(const std::vector<double>& actions, StepBatch::Response& response,
                      const std::function<void()>& on_stepped) {
  clear(response.failed_environments, response.failed_at_reset, response.failures,
        response.final_environments, response.final_observations, response.final_info,
        response.worlds, response.status_message);
  const auto record_and_show = [&] {
    record_steps(actions, response);
    on_stepped();
  };
  // A std::function of a reference allocates no memory.
  pool_.step(actions.data(), actions.size(), rows_of(response), std::cref(record_and_show));
  if (options_.autoreset_mode != AutoresetMode::same_step) return;
  for (const std::uint32_t environment : ended_) record(state_of(environment), response);
}

/// Resizes the response's vectors and returns pointers to their elements.
Batch BatchCalls::rows_of(StepBatch::Response& response) const {
  const auto resized = [](auto& values, std::size_t size) {
    values.resize(size);
    return values.data();
  };
  const std::size_t size = all_.size();
  Batch rows;
  rows.observations = resized(response.observations, size * specification_.observation_size());
  rows.rewards = resized(response.rewards, size);
  rows.terminated = resized(response.terminated, size);
  rows.truncated = resized(response.truncated, size);
  rows.episodes = resized(response.episodes, size);
  rows.steps = resized(response.steps, size);
  rows.info = resized(response.info, size * specification_.info_names.size());
  return rows;
}

/// Records the states that a step has reached, and lists the episodes that it has ended.
void BatchCalls::record_steps(const std::vector<double>& actions, StepBatch::Response& response) {
  ended_.clear();
  for (const std::uint32_t environment : all_) {
    const EpisodeState& state = state_of(environment);
    record(state, response);
    if (state.step != 0) {
      const double* action = actions.data() + environment * specification_.action_size();
      if (is_clamped(specification_, action)) ++account_.counters.clamped_commands;
      if (state.has_ended()) ended_.push_back(environment);
    }
    if (state.has_ended() && options_.autoreset_mode == AutoresetMode::same_step) {
      response.final_environments.push_back(environment);
      append(state.observation, response.final_observations);
      append(state.info, response.final_info);
    }
  }
}

/// Records the state after a step or a reset.
template <typename Response>
void BatchCalls::record(const EpisodeState& state, Response& response) {
  account_.add(state);
  if (!state.error.empty()) record_failure(state, response);
  if (state.step == 0) append_world(state, response.worlds);
}

template <typename Response>
void BatchCalls::record_failure(const EpisodeState& state, Response& response) {
  const std::string text = std::to_string(state.environment) + ": " +
                           (state.failed_at_reset() ? kResetFailed : kStepFailed) + ": " +
                           state.error;
  if (throttle_.passes()) ROS_ERROR_STREAM("Environment " << text);
  if (!response.status_message.empty()) response.status_message += '\n';
  response.status_message += "environment " + text;
  response.failed_environments.push_back(state.environment);
  response.failures.push_back(state.error);
  if constexpr (std::is_same_v<Response, StepBatch::Response>) {
    response.failed_at_reset.push_back(state.failed_at_reset() ? 1 : 0);
  }
}

}  // namespace walker
