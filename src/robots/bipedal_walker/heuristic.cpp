#include "robots/bipedal_walker/heuristic.h"

#include <algorithm>

namespace walker::bipedal_walker {
namespace {

// Constants of BipedalWalkerHeuristics (gymnasium/envs/box2d/bipedal_walker.py, 1.4.0).
constexpr double kSpeed = 0.29;  // falls forward if faster
constexpr double kSupportKneeAngle = 0.1;
constexpr std::size_t kLegOffset = 4;  // index of the first leg in the observation
constexpr std::size_t kLegStride = 5;  // hip angle, hip speed, knee angle, knee speed, contact

/// PD control towards a target. Gymnasium treats a target of zero as no target.
float pull(double target, float gain, float angle, float speed) {
  if (target == 0) return 0;
  return gain * (static_cast<float>(target) - angle) - 0.25F * speed;
}

}  // namespace

void Heuristic::reset() {
  phase_ = Phase::stay_on_one_leg;
  moving_leg_ = 0;
  supporting_leg_ = 1;
  supporting_knee_ = {kSupportKneeAngle, false};
}

void Heuristic::limit_supporting_knee() {
  if (supporting_knee_.is_above(kSupportKneeAngle)) supporting_knee_ = {kSupportKneeAngle, false};
}

void Heuristic::choose_targets(const std::array<float, 14>& state, std::array<double, 2>& hip,
                               std::array<double, 2>& knee) {
  const float* moving = &state[kLegOffset + kLegStride * moving_leg_];
  const float* supporting = &state[kLegOffset + kLegStride * supporting_leg_];
  const float forward_speed = state[2];
  if (phase_ == Phase::stay_on_one_leg) {
    hip[moving_leg_] = 1.1;
    knee[moving_leg_] = -0.6;
    supporting_knee_.add(0.03);
    if (forward_speed > static_cast<float>(kSpeed)) supporting_knee_.add(0.03);
    limit_supporting_knee();
    knee[supporting_leg_] = supporting_knee_.value;
    const bool support_is_behind = supporting[0] < 0.10F;
    if (support_is_behind) phase_ = Phase::put_other_down;
  }
  if (phase_ == Phase::put_other_down) {
    hip[moving_leg_] = 0.1;
    knee[moving_leg_] = kSupportKneeAngle;
    knee[supporting_leg_] = supporting_knee_.value;
    const bool moving_leg_landed = moving[4] != 0;
    if (moving_leg_landed) {
      phase_ = Phase::push_off;
      supporting_knee_ = {double{moving[2]}, true};
      limit_supporting_knee();
    }
  }
  if (phase_ == Phase::push_off) {
    knee[moving_leg_] = supporting_knee_.value;
    knee[supporting_leg_] = 1.0;
    if (supporting[2] > 0.88F || forward_speed > static_cast<float>(1.2 * kSpeed)) {
      phase_ = Phase::stay_on_one_leg;
      std::swap(moving_leg_, supporting_leg_);
    }
  }
}

void Heuristic::act(const double* observation, double* action) {
  std::array<float, 14> state{};
  std::transform(observation, observation + state.size(), state.begin(),
                 [](double value) { return static_cast<float>(value); });
  std::array<double, 2> hip_target{};
  std::array<double, 2> knee_target{};
  choose_targets(state, hip_target, knee_target);
  for (std::size_t leg = 0; leg < 2; ++leg) {
    const float* part = &state[kLegOffset + kLegStride * leg];
    float hip = pull(hip_target[leg], 0.9F, part[0], part[1]);
    float knee = pull(knee_target[leg], 4.0F, part[2], part[3]);
    hip -= 0.9F * (0.0F - state[0]) - 1.5F * state[1];  // keeps the hull level
    knee -= 15.0F * state[3];                           // damps vertical oscillations
    action[2 * leg] = std::clamp(0.5 * double{hip}, -1.0, 1.0);
    action[2 * leg + 1] = std::clamp(0.5 * double{knee}, -1.0, 1.0);
  }
}

}  // namespace walker::bipedal_walker
