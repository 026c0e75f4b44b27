// An in-process environment with which tests compare a server's responses.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "walker_sim/registry.h"

namespace walker::test {

/// The bits of doubles. Unlike ==, they compare NaN equal to itself and distinguish -0 from 0.
inline std::vector<std::uint64_t> bits(const std::vector<double>& values) {
  std::vector<std::uint64_t> words(values.size());
  if (!values.empty()) std::memcpy(words.data(), values.data(), values.size() * sizeof(double));
  return words;
}

/// An environment with the buffers, step count and return that a server keeps.
class Twin {
 public:
  explicit Twin(const std::string& id, const Parameters& parameters = {})
      : environment_(make(id, parameters)),
        observation_(environment_->specification().observation_size()),
        info_(environment_->specification().info_names.size()) {
    result_.observation = observation_.data();
    result_.info = info_.data();
  }

  void reset(std::optional<std::uint64_t> seed) {
    environment_->reset(seed, result_);
    step_ = 0;
    episode_return_ = 0;
  }

  void step(const std::vector<double>& action) {
    environment_->step(action.data(), action.size(), result_);
    ++step_;
    episode_return_ += result_.reward;
  }

  Environment& environment() const { return *environment_; }
  const Sensors& sense() {
    environment_->sense(sensors_);
    return sensors_;
  }
  const std::vector<double>& observation() const { return observation_; }
  double episode_return() const { return episode_return_; }
  bool has_ended() const { return result_.terminated || result_.truncated; }
  std::string end_reason() const { return result_.end_reason; }

  /// Compares a transition with the twin's, bit by bit.
  /// @param other walker_sim::Transition, or the client library's Transition
  template <typename AnyTransition>
  testing::AssertionResult equals(const AnyTransition& other) const {
    const auto differ = [&](const char* what) {
      return testing::AssertionFailure() << what << " differs at step " << step_;
    };
    if (other.step != step_) return differ("step") << ": received " << other.step;
    if (bits(other.observation) != bits(observation_)) return differ("observation");
    if (bits({other.reward}) != bits({result_.reward})) return differ("reward");
    if (bits({other.episode_return}) != bits({episode_return_})) return differ("episode_return");
    if ((other.terminated != 0) != result_.terminated) return differ("terminated");
    if ((other.truncated != 0) != result_.truncated) return differ("truncated");
    if (bits(other.info) != bits(info_)) return differ("info");
    if (other.error != result_.error) return differ("error");
    return testing::AssertionSuccess();
  }

 private:
  std::unique_ptr<Environment> environment_;
  std::vector<double> observation_;
  std::vector<double> info_;
  Result result_;
  Sensors sensors_;
  std::uint32_t step_ = 0;
  double episode_return_ = 0;
};

}  // namespace walker::test
