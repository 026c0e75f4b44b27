// Plays episodes with actions determined by a kind and a seed, as in bipedal_walker_reference.py.
#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/random.h"
#include "recording.h"
#include "robots/bipedal_walker/bipedal_walker.h"
#include "robots/bipedal_walker/heuristic.h"
#include "stepper.h"

namespace walker::bipedal_walker {

constexpr const char* kPlain = "BipedalWalker-v3";
constexpr const char* kHardcore = "BipedalWalkerHardcore-v3";

class Actions {
 public:
  /// @param kind random, heuristic, noisy, zero, saturated, outside or double
  Actions(std::string kind, std::uint64_t seed) : kind_(std::move(kind)), generator_(seed) {}

  void draw(const std::vector<double>& observation, std::vector<double>& action) {
    action.assign(kJointCount, 0);
    if (kind_ == "heuristic" || kind_ == "noisy") {
      heuristic_.act(observation.data(), action.data());
    }
    for (double& value : action) value = change(value);
  }

 private:
  double change(double value) {
    if (kind_ == "zero" || kind_ == "heuristic") return value;
    if (kind_ == "noisy") return rounded(value + generator_.uniform(-0.5, 0.5));
    if (kind_ == "saturated") return static_cast<double>(generator_.integers(-1, 2));
    if (kind_ == "random") return rounded(generator_.uniform(-1, 1));
    if (kind_ == "outside") return rounded(generator_.uniform(-3, 3));
    if (kind_ == "double") return generator_.uniform(-1, 1);
    throw std::invalid_argument("kind " + kind_ + ": unknown");
  }

  static double rounded(double value) { return double{static_cast<float>(value)}; }

  std::string kind_;
  Generator generator_;
  Heuristic heuristic_;
};

/// Resets and plays to the end of the episode, at most `most_steps` steps. Row 0 is the reset.
inline std::vector<std::vector<double>> play(Stepper& walker, std::optional<std::uint64_t> seed,
                                             Actions actions, std::size_t most_steps = 5000) {
  walker.reset(seed);
  std::vector<std::vector<double>> rows{walker.row()};
  std::vector<double> action;
  while (!walker.has_ended() && rows.size() <= most_steps) {
    actions.draw(walker.observation, action);
    walker.step(action);
    rows.push_back(walker.row());
  }
  return rows;
}

}  // namespace walker::bipedal_walker
