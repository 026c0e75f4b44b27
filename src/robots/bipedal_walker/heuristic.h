// Gymnasium's hand-written gait, BipedalWalkerHeuristics.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "walker_sim/agent.h"
#include "walker_sim/export.h"

namespace walker::bipedal_walker {

/// Swings one leg forward, puts it down, and pushes off with the other. It does not balance,
/// so its return exceeds 200 on only about 15 % of the grounds.
///
/// Inputs: the observation's first 14 values s, of which s[2] is the scaled forward speed. Angles
/// and speeds below are the observation's (knee angles plus 1). State: the phase, which leg moves,
/// and the supporting knee's target k.
///
///   hip    = 0.9 (target - angle) - 0.25 speed + 0.9 s[0] + 1.5 s[1]
///   knee   = 4   (target - angle) - 0.25 speed - 15 s[3]
///   action = clamp(0.5 hip or knee, -1, 1)
///
/// A target of 0 contributes neither of its two terms. The phases, in a cycle:
///
///   stay_on_one_leg  targets: moving hip 1.1, moving knee -0.6, supporting knee k.
///                    k, at first 0.1, becomes min(k + 0.03, 0.1); + 0.06 if s[2] > 0.29
///                    until the supporting hip < 0.1
///   put_other_down   targets: moving hip 0.1, moving knee 0.1, supporting knee k
///                    until the moving leg touches; then k = min(moving knee, 0.1)
///   push_off         targets: moving knee k, supporting knee 1
///                    until the supporting knee > 0.88 or s[2] > 1.2 * 0.29; then the legs swap
///
/// A step that ends one of the first two phases continues with the next.
///
/// Rounds to single precision wherever Gymnasium does, which computes with float32 observations
/// under NumPy 2. Actions are float32 values in [-1, 1].
///
/// Source: Gymnasium 1.4.0, envs/box2d/bipedal_walker.py, BipedalWalkerHeuristics.step_heuristic.
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
