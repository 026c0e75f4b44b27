// Result arrays of a pool.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "walker_sim/pool.h"

namespace walker {

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

}  // namespace walker
