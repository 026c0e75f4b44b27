#include "server/environments.h"

#include <algorithm>
#include <stdexcept>

#include "base/random.h"

namespace walker {
Pool make_pool(const ServerOptions& options, const MakeEnvironment& make) {
  PoolOptions pool_options;
  pool_options.num_envs = options.num_envs;
  pool_options.num_threads = std::min(options.num_threads, options.num_envs);
  pool_options.autoreset_mode = options.autoreset_mode == AutoresetMode::same_step
                                    ? AutoresetMode::next_step
                                    : options.autoreset_mode;
  const std::uint64_t seed = options.seed ? *options.seed : draw_seed();
  std::uint32_t index = 0;
  const auto make_episode = [&] {
    std::unique_ptr<Environment> environment = make();
    EpisodeOptions own;
    own.records_actions = index == options.shown_environment;
    own.first_seed = seed + index++;
    episode_of(*environment).configure(own);
    return environment;
  };
  return {make_episode, pool_options};
}

Episode& single_episode(Pool& pool, const std::string& service) {
  if (pool.options().num_envs == 1) return pool.episode(0);
  throw std::logic_error(service + ": is for one environment, and this server has num_envs = " +
                         std::to_string(pool.options().num_envs) +
                         "; call ~reset_batch and ~step_batch");
}

void check_environment(const Pool& pool, const std::string& field, std::uint32_t index) {
  const std::size_t num_envs = pool.options().num_envs;
  if (index < num_envs) return;
  throw std::invalid_argument(field + " = " + std::to_string(index) +
                              "; must be below num_envs = " + std::to_string(num_envs));
}

}  // namespace walker
