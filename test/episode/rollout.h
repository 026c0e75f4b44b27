// Pools with their result arrays.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "bits.h"
#include "walker_sim/pool.h"
#include "walker_sim/registry.h"

namespace walker {

constexpr AutoresetMode kModes[] = {AutoresetMode::next_step, AutoresetMode::same_step,
                                    AutoresetMode::disabled};

struct PoolArrays {
  /// Fills the arrays with values that no environment produces.
  PoolArrays(const Specification& specification, std::size_t count)
      : observation_size(specification.observation_size()),
        num_infos(specification.info_names.size()),
        observations(count * observation_size, kUntouched),
        rewards(count, kUntouched),
        terminated(count, 9),
        truncated(count, 9),
        info(count * num_infos, kUntouched),
        episodes(count, 999),
        steps(count, 999),
        final_observations(count * observation_size, kUntouched),
        final_info(count * num_infos, kUntouched) {}

  Batch batch() {
    return {observations.data(), rewards.data(),  terminated.data(), truncated.data(),
            info.data(),         episodes.data(), steps.data(),      final_observations.data(),
            final_info.data()};
  }

  std::vector<double> row(std::size_t i) const {
    std::vector<double> all{rewards[i], double{1} * terminated[i], double{1} * truncated[i],
                            double{1} * episodes[i], double{1} * steps[i]};
    append(observations, i, observation_size, all);
    append(info, i, num_infos, all);
    append(final_observations, i, observation_size, all);
    append(final_info, i, num_infos, all);
    return all;
  }

  /// Clears row `i` of the arrays that only an episode's end writes.
  void forget_final(std::size_t i) {
    std::fill_n(final_observations.begin() + i * observation_size, observation_size, kUntouched);
    std::fill_n(final_info.begin() + i * num_infos, num_infos, kUntouched);
  }

  static constexpr double kUntouched = -12345;

  std::size_t observation_size;
  std::size_t num_infos;
  std::vector<double> observations;
  std::vector<double> rewards;
  std::vector<std::uint8_t> terminated;
  std::vector<std::uint8_t> truncated;
  std::vector<double> info;
  std::vector<std::uint32_t> episodes;
  std::vector<std::uint32_t> steps;
  std::vector<double> final_observations;
  std::vector<double> final_info;

 private:
  static void append(const std::vector<double>& rows, std::size_t i, std::size_t size,
                     std::vector<double>& all) {
    all.insert(all.end(), rows.begin() + i * size, rows.begin() + (i + 1) * size);
  }
};

/// A pool that plays random actions.
class Rollout {
 public:
  Rollout(const std::string& id, const PoolOptions& options, const Parameters& parameters = {})
      : pool([&] { return make(id, parameters); }, options),
        arrays(pool.specification(), options.num_envs) {}

  void reset(std::uint64_t first_seed) {
    std::vector<std::optional<std::uint64_t>> seeds(pool.options().num_envs);
    for (std::size_t i = 0; i < seeds.size(); ++i) seeds[i] = first_seed + i;
    pool.reset({}, seeds, arrays.batch());
  }

  std::vector<double> draw_actions(std::mt19937& random, std::size_t num_envs) const {
    std::uniform_real_distribution<double> unit(-1, 1);
    std::vector<double> actions(num_envs * pool.specification().action_size());
    for (double& action : actions) action = unit(random);
    return actions;
  }

  void step(std::mt19937& random) {
    const std::vector<double> actions = draw_actions(random, pool.options().num_envs);
    for (std::uint32_t i = 0; i < pool.options().num_envs; ++i) arrays.forget_final(i);
    if (pool.options().autoreset_mode == AutoresetMode::disabled) reset_ended();
    pool.step(actions.data(), actions.size(), arrays.batch());
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
};

}  // namespace walker
