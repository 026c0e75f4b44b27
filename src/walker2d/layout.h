// Which joint, body and actuator of a model is which part of the walker.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "walker2d/constants.h"
#include "walker2d/mujoco.h"

namespace walker::walker2d {

/// Why a model is no planar walker, in words that end a sentence about the file; empty when it is
/// one. It must have the joints of Gymnasium's walker in kind and number: two slides and a hinge of
/// the trunk, six hinges with a limb each, and a motor with a control range for each of the six.
std::string describe_misfit(const mjModel& model);

/// Indices into the model's arrays. For models without a misfit.
struct Layout {
  explicit Layout(const mjModel& model);

  int trunk;                              ///< body
  std::array<int, kJointCount> joints{};  ///< in action order
  std::array<int, kJointCount> limbs{};   ///< bodies that these joints carry
  std::vector<int> feet;                  ///< limbs that carry no other limb, in action order
};

/// The nearest body up the tree, itself included, that a joint moves, or 0, the world: bodies
/// without joints are parts of it.
int carrier_of(const mjModel& model, int body);

/// Torque of the joint for a control of 1, negative where the motor turns backwards [N m].
double effort_per_control(const mjModel& model, int actuator);

}  // namespace walker::walker2d
