// An in-process environment with which tests compare a server's responses.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bits.h"
#include "stepper.h"

namespace walker::test {

/// Unlike doubles, their bits compare NaN equal to itself and distinguish -0 from 0.
inline std::vector<std::uint64_t> bits(const std::vector<double>& values) {
  return to_bits(values);
}

/// An environment with the buffers, step count and return that a server keeps.
class Twin {
 public:
  explicit Twin(const std::string& id, const Parameters& parameters = {})
      : stepper_(id, parameters) {}

  void reset(std::optional<std::uint64_t> seed) {
    stepper_.reset(seed);
    step_ = 0;
    episode_return_ = 0;
  }

  void step(const std::vector<double>& action) {
    stepper_.step(action);
    ++step_;
    episode_return_ += stepper_.result.reward;
  }

  Environment& environment() const { return *stepper_.environment; }
  const Sensors& sense() {
    environment().sense(sensors_);
    return sensors_;
  }
  const std::vector<double>& observation() const { return stepper_.observation; }
  double episode_return() const { return episode_return_; }
  bool has_ended() const { return stepper_.has_ended(); }
  std::string end_reason() const { return stepper_.result.end_reason; }

  /// Compares a transition with the twin's, bit by bit.
  /// @param other walker_sim::Transition, or the client library's Transition
  template <typename AnyTransition>
  testing::AssertionResult equals(const AnyTransition& other) const {
    const Result& result = stepper_.result;
    const auto differ = [&](const char* what) {
      return testing::AssertionFailure() << what << " differs at step " << step_;
    };
    if (other.step != step_) return differ("step") << ": received " << other.step;
    if (bits(other.observation) != bits(stepper_.observation)) return differ("observation");
    if (bits({other.reward}) != bits({result.reward})) return differ("reward");
    if (bits({other.episode_return}) != bits({episode_return_})) return differ("episode_return");
    if ((other.terminated != 0) != result.terminated) return differ("terminated");
    if ((other.truncated != 0) != result.truncated) return differ("truncated");
    if (bits(other.info) != bits(stepper_.info)) return differ("info");
    if (other.error != result.error) return differ("error");
    return testing::AssertionSuccess();
  }

 private:
  Stepper stepper_;
  Sensors sensors_;
  std::uint32_t step_ = 0;
  double episode_return_ = 0;
};

}  // namespace walker::test
