// Joints, bodies and actuators of a planar robot's model.
#pragma once

#include <string>
#include <vector>

#include "robots/mujoco/engine.h"
#include "walker_sim/observation_builder.h"
#include "walker_sim/specification.h"

namespace walker::mujoco {

/// Number of the trunk's joints, the model's first: two slides and a hinge.
constexpr int kBaseJoints = 3;

/// Indices of the trunk's joints in MuJoCo's qpos and qvel.
enum BaseIndex { kBaseX, kBaseZ, kBasePitch };

/// A planar robot's model: a trunk on two slides and a hinge, and further hinges, each with a limb
/// and a motor with a control range.
struct PlanarModel {
  std::string xml_file;  ///< argument of `load_model`
  int num_hinges = 0;    ///< hinges that carry a limb
  std::string example;   ///< built-in model that error messages refer to
};

/// Compiles the model, or returns the compiled one that another environment holds.
/// @throws std::invalid_argument as `load_model`, or naming the part of the model that does not fit
///         such a robot
ModelPointer load_planar_model(const PlanarModel& source);

/// Indices into the model's arrays.
struct Layout {
  /// @param model returned by `load_planar_model`
  explicit Layout(const mjModel& model);

  int trunk;                ///< body
  std::vector<int> joints;  ///< hinges in action order
  std::vector<int> limbs;   ///< bodies that these hinges move
  std::vector<int> feet;    ///< limbs that carry no other limb, in action order
};

/// Returns an element's name for messages, or its number if it has none.
/// @param type of MuJoCo's mjtObj
std::string element_name(const mjModel& model, int type, int index);

/// Returns the nearest body with a joint from this one towards the root, itself included; 0, the
/// world, if there is none. Bodies without joints are parts of that body.
int carrier_of(const mjModel& model, int body);

/// Returns the joint's torque at a control of 1; negative if the motor turns backwards [N m].
double effort_per_control(const mjModel& model, int actuator);

/// Returns the trunk's origin in the world [m].
/// @param position MuJoCo's qpos
Vector3 base_origin(const mjModel& model, const double* position);

/// @param origin      of the trunk in the world [m]
/// @param orientation of the trunk in the world
/// @param position    receives the trunk's part of MuJoCo's qpos; the pitch is modulo whole turns
void write_base_position(const mjModel& model, const Vector3& origin, const Quaternion& orientation,
                         double* position);

/// @param velocity receives the trunk's part of MuJoCo's qvel
void write_base_velocity(const mjModel& model, const Measurements& measurements, double* velocity);

}  // namespace walker::mujoco
