// Walker2d's sizes, and actions determined by a kind and a seed, as in mujoco_reference.py.
#pragma once

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "base/random.h"
#include "robots/mujoco/planar_model.h"

namespace walker::mujoco {

constexpr int kJointCount = 6;
constexpr int kDegreesOfFreedom = kBaseJoints + kJointCount;
constexpr int kFrameSkip = 4;  // Gymnasium's default; engine steps per step

class Actions {
 public:
  /// @param kind random, saturated, zero, outside, smooth, balance or double
  Actions(std::string kind, std::uint64_t seed, int size = kJointCount)
      : kind_(std::move(kind)), size_(size), generator_(seed), slow_(size) {}

  void draw(const std::vector<double>& observation, std::vector<double>& action) {
    action.resize(size_);
    for (int i = 0; i < size_; ++i) action[i] = value(observation, i);
  }

 private:
  double value(const std::vector<double>& observation, int joint) {
    if (kind_ == "zero") return 0;
    if (kind_ == "saturated") return static_cast<double>(generator_.integers(-1, 2));
    if (kind_ == "random") return rounded(generator_.uniform(-1, 1));
    if (kind_ == "outside") return rounded(generator_.uniform(-3, 3));
    if (kind_ == "double") return generator_.uniform(-1, 1);
    slow_[joint] = 0.95 * slow_[joint] + generator_.uniform(-0.03, 0.03);
    if (kind_ == "smooth") return rounded(slow_[joint]);
    if (kind_ != "balance") throw std::invalid_argument("kind " + kind_ + ": unknown");
    // Indexed from the end, because x may come first: tilt, joint angles, joint speeds.
    const double* const end = observation.data() + observation.size();
    const bool is_foot = joint % 3 == 2;
    const double* const angles = end - std::ptrdiff_t{2} * size_ - 3;
    const double off_level = angles[-1] * (is_foot ? 1 : 0);
    return rounded(-0.5 * (angles[joint] + off_level) - 0.05 * end[joint - size_] + slow_[joint]);
  }

  static double rounded(double value) { return double{static_cast<float>(value)}; }

  std::string kind_;
  int size_;
  Generator generator_;
  std::vector<double> slow_;
};

}  // namespace walker::mujoco
