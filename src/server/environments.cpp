#include "server/environments.h"

#include <stdexcept>

#include "base/random.h"

namespace walker {
namespace {

PoolOptions pool_options(const ServerOptions& options) {
  PoolOptions own;
  own.num_envs = options.num_envs;
  own.num_threads = options.num_threads;
  own.autoreset_mode = options.autoreset_mode == AutoresetMode::same_step ? AutoresetMode::next_step
                                                                          : options.autoreset_mode;
  return own;
}

}  // namespace

Pool make_pool(const ServerOptions& options, const MakeEnvironment& make) {
  const std::uint64_t seed = options.seed ? *options.seed : draw_seed();
  std::uint32_t index = 0;
  const auto make_episode = [&] {
    std::unique_ptr<Environment> environment = make();
    EpisodeOptions own;
    own.first_seed = seed + index++;
    own.records_actions = options.num_envs == 1;
    episode_of(*environment).configure(own);
    return environment;
  };
  return Pool(make_episode, pool_options(options));
}

Episode& single_episode(Pool& pool, const std::string& service) {
  if (pool.options().num_envs == 1) return episode(pool, 0);
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
