// An environment with result buffers.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "walker_sim/registry.h"

namespace walker {

struct Stepper {
  explicit Stepper(const std::string& id, const Parameters& parameters = {})
      : Stepper(make(id, parameters)) {}
  explicit Stepper(std::unique_ptr<Environment> one)
      : environment(std::move(one)),
        observation(environment->specification().observation_size()),
        info(environment->specification().info_names.size()) {
    result.observation = observation.data();
    result.info = info.data();
  }

  void reset(std::optional<std::uint64_t> seed = std::nullopt) { environment->reset(seed, result); }

  void step(const std::vector<double>& action) {
    environment->step(action.data(), action.size(), result);
  }

  bool has_ended() const { return result.terminated || result.truncated; }

  /// Row of the last result: observation, reward, terminated, truncated, info.
  std::vector<double> row() const {
    std::vector<double> numbers = observation;
    numbers.push_back(result.reward);
    numbers.push_back(result.terminated ? 1 : 0);
    numbers.push_back(result.truncated ? 1 : 0);
    numbers.insert(numbers.end(), info.begin(), info.end());
    return numbers;
  }

  std::unique_ptr<Environment> environment;
  std::vector<double> observation;
  std::vector<double> info;
  Result result;
};

}  // namespace walker
