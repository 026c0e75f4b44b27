// A pool that plays random actions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "bits.h"
#include "episode/pool_arrays.h"
#include "walker_sim/registry.h"

namespace walker {

class Rollout {
 public:
  Rollout(const std::string& id, const PoolOptions& options, const Parameters& parameters = {})
      : pool([&] { return make(id, parameters); }, options),
        arrays(pool.specification(), options.num_envs),
        actions_(options.num_envs * pool.specification().action_size()) {}

  void reset(std::uint64_t first_seed) {
    std::vector<std::optional<std::uint64_t>> seeds(pool.options().num_envs);
    for (std::size_t i = 0; i < seeds.size(); ++i) seeds[i] = first_seed + i;
    pool.reset({}, seeds, arrays.batch());
  }

  void step(std::mt19937& random) {
    std::uniform_real_distribution<double> unit(-1, 1);
    for (double& action : actions_) action = unit(random);
    for (std::uint32_t i = 0; i < pool.options().num_envs; ++i) arrays.forget_final(i);
    if (pool.options().autoreset_mode == AutoresetMode::disabled) reset_ended();
    pool.step(actions_.data(), actions_.size(), arrays.batch());
  }

  void play(std::mt19937& random, int num_steps) {
    for (int i = 0; i < num_steps; ++i) step(random);
  }

  std::vector<std::vector<std::byte>> save() const {
    std::vector<std::vector<std::byte>> states(pool.options().num_envs);
    for (std::size_t i = 0; i < states.size(); ++i) pool.save_state(i, states[i]);
    return states;
  }

  /// Bits of a row, without the number of episodes.
  std::vector<std::uint64_t> row(std::size_t index) const {
    std::vector<double> row = arrays.row(index);
    row[3] = 0;
    return to_bits(row);
  }

  Pool pool;
  PoolArrays arrays;

 private:
  void reset_ended() {
    std::vector<std::uint32_t> ended;
    for (std::uint32_t i = 0; i < pool.options().num_envs; ++i) {
      if (arrays.terminated[i] == 1 || arrays.truncated[i] == 1) ended.push_back(i);
    }
    if (!ended.empty()) pool.reset(ended, {}, arrays.batch());
  }

  std::vector<double> actions_;
};

}  // namespace walker
