// Gymnasium's hand-written gait, BipedalWalkerHeuristics.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "walker_sim/agent.h"
#include "walker_sim/export.h"

namespace walker::bipedal_walker {

/// Swings one leg forward, puts it down, and pushes off with the other. It does not balance,
/// so its return exceeds 200 on only about 15 % of the terrains.
///
/// Rounds to single precision wherever Gymnasium does, which computes with float32 observations
/// under NumPy 2. Actions are float32 values in [-1, 1].
class WALKER_SIM_EXPORT Heuristic : public Agent {
 public:
  Heuristic() { Heuristic::reset(); }
  void reset() override;
  const std::vector<double>& act(const std::vector<double>& observation) override {
    act(observation.data(), action_.data());
    return action_;
  }
  /// @param observation 24 values, as BipedalWalker returns them
  /// @param action      receives 4 values
  void act(const double* observation, double* action);

 private:
  enum class Phase { stay_on_one_leg, put_other_down, push_off };

  /// A Python number: a double until a float32 value of the observation replaces it. From then on,
  /// arithmetic with it is in single precision.
  struct KneeAngle {
    double value;
    bool is_single;

    void add(double increment) {
      value = is_single ? double{static_cast<float>(value) + static_cast<float>(increment)}
                        : value + increment;
    }
    bool is_above(double limit) const {
      return is_single ? static_cast<float>(value) > static_cast<float>(limit) : value > limit;
    }
  };

  void limit_supporting_knee();
  void choose_targets(const std::array<float, 14>& state, std::array<double, 2>& hip,
                      std::array<double, 2>& knee);

  Phase phase_;
  std::size_t moving_leg_;
  std::size_t supporting_leg_;
  KneeAngle supporting_knee_;
  std::vector<double> action_{0, 0, 0, 0};
};

}  // namespace walker::bipedal_walker
