// An environment with the buffers that its results need.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "walker_sim/registry.h"

namespace walker {

struct Stepper {
  explicit Stepper(const std::string& id, const Parameters& parameters = {})
      : environment(make(id, parameters)),
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

  std::unique_ptr<Environment> environment;
  std::vector<double> observation;
  std::vector<double> info;
  Result result;
};

}  // namespace walker
