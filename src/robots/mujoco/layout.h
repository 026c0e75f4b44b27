// Which joint, body and actuator of a model is which part of a planar robot.
#pragma once

#include <string>
#include <vector>

#include "robots/mujoco/engine.h"

namespace walker::mujoco {

/// A planar robot's model: a trunk on two slides and a hinge, further hinges with a limb each, and
/// a motor with a control range for each of these.
struct PlanarModel {
  std::string xml_file;  ///< as `load_model` takes it
  int num_hinges = 0;    ///< of limbs
  std::string example;   ///< the built-in model that shows how one looks
};

/// Compiles it, or returns the compiled one that another environment still holds.
/// @throws std::invalid_argument as `load_model`, or with what is wrong where its joints or
///         actuators are not those of such a robot
ModelPointer load_planar_model(const PlanarModel& source);

/// Indices into the model's arrays.
struct Layout {
  /// @param model as `load_planar_model` gives it
  explicit Layout(const mjModel& model);

  int trunk;                ///< body
  std::vector<int> joints;  ///< hinges in action order
  std::vector<int> limbs;   ///< bodies that these carry
  std::vector<int> feet;    ///< limbs that carry no other limb, in action order
};

/// The nearest body up the tree, itself included, that a joint moves, or 0, the world: bodies
/// without joints are parts of it.
int carrier_of(const mjModel& model, int body);

/// Torque of the joint for a control of 1, negative where the motor turns backwards [N m].
double effort_per_control(const mjModel& model, int actuator);

}  // namespace walker::mujoco
