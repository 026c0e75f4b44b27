#include "robots/mujoco/planar_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "base/shortest_text.h"
#include "robots/mujoco/model.h"

namespace walker::mujoco {
namespace {

void check_sizes(const mjModel& model, const PlanarModel& source) {
  const int num_joints = kBaseJoints + source.num_hinges;
  const bool fits = model.nq == num_joints && model.nv == num_joints && model.njnt == num_joints &&
                    model.nu == source.num_hinges && model.na == 0;
  if (fits) return;
  ClassicStream text;
  text << "nq = " << model.nq << ", nv = " << model.nv << ", nu = " << model.nu
       << ", na = " << model.na << "; must be nq = nv = " << num_joints
       << ", nu = " << source.num_hinges << ", na = 0, as in " << source.example;
  refuse_model(source.xml_file, text.str());
}

/// Simulation time is published in whole nanoseconds and must increase.
void check_timestep(const mjModel& model, const PlanarModel& source) {
  constexpr double kShortest = 1e-6;  // [s]
  if (model.opt.timestep >= kShortest) return;
  ClassicStream text;
  text << "timestep = " << model.opt.timestep << " s; must be at least " << kShortest << " s";
  refuse_model(source.xml_file, text.str());
}

/// Returns the axis of one of the trunk's joints in the world.
Vector3 world_axis(const mjModel& model, int joint) {
  Vector3 axis{};
  mju_rotVecQuat(axis.data(), at(model.jnt_axis, joint, 3),
                 at(model.body_quat, model.jnt_bodyid[joint], 4));
  return axis;
}

void check_base(const mjModel& model, const PlanarModel& source) {
  const int trunk = model.jnt_bodyid[kBaseX];
  const bool is_planar =
      model.jnt_type[kBaseX] == mjJNT_SLIDE && model.jnt_type[kBaseZ] == mjJNT_SLIDE &&
      model.jnt_type[kBasePitch] == mjJNT_HINGE && model.jnt_bodyid[kBaseZ] == trunk &&
      model.jnt_bodyid[kBasePitch] == trunk && model.body_parentid[trunk] == 0;
  if (!is_planar) {
    refuse_model(source.xml_file,
                 "the first three joints must be the trunk's: slide (x), slide (z), hinge (pitch)");
  }
  constexpr double kAligned = 1 - 1e-6;  // for rounding
  if (!(world_axis(model, kBaseX)[0] > kAligned && world_axis(model, kBaseZ)[2] > kAligned &&
        world_axis(model, kBasePitch)[1] > kAligned)) {
    refuse_model(source.xml_file,
                 "the trunk must slide along the world's x, then z, and turn about its y");
  }
  const mjtNum* const anchor = at(model.jnt_pos, kBasePitch, 3);
  if (anchor[0] != 0 || anchor[1] != 0 || anchor[2] != 0) {
    refuse_model(source.xml_file, "joint " + element_name(model, mjOBJ_JOINT, kBasePitch) +
                                      ": must turn about the trunk's origin (pos 0 0 0)");
  }
}

void check_limb(const mjModel& model, const PlanarModel& source, int joint) {
  const std::string name = "joint " + element_name(model, mjOBJ_JOINT, joint);
  const int body = model.jnt_bodyid[joint];
  if (model.jnt_type[joint] != mjJNT_HINGE || model.body_jntnum[body] != 1) {
    refuse_model(source.xml_file, name + ": must be a hinge, and the only joint of its body");
  }
  if (carrier_of(model, model.body_parentid[body]) == 0) {
    refuse_model(source.xml_file, name + ": must carry a limb of the trunk");
  }
}

int joint_of(const mjModel& model, int actuator) {
  return at(model.actuator_trnid, actuator, 2)[0];
}

/// For a hinge, MuJoCo treats the transmissions `jointinparent` and `joint` alike.
bool drives_joint(const mjModel& model, int actuator) {
  const int transmission = model.actuator_trntype[actuator];
  return transmission == mjTRN_JOINT || transmission == mjTRN_JOINTINPARENT;
}

/// The action must determine the effort, and the model must bound the action.
void check_actuator(const mjModel& model, const PlanarModel& source, int actuator) {
  const int joint = joint_of(model, actuator);
  const auto refuse = [&](const std::string& reason) {
    refuse_model(source.xml_file,
                 "actuator " + element_name(model, mjOBJ_ACTUATOR, actuator) + ": " + reason);
  };
  if (!drives_joint(model, actuator) || joint < kBaseJoints) {
    refuse("must drive one of the " + std::to_string(model.nu) + " hinges");
  }
  for (int other = 0; other < actuator; ++other) {
    if (joint_of(model, other) == joint) {
      refuse("drives a joint that actuator " + element_name(model, mjOBJ_ACTUATOR, other) +
             " drives already");
    }
  }
  if (model.actuator_gaintype[actuator] != mjGAIN_FIXED ||
      model.actuator_biastype[actuator] != mjBIAS_NONE) {
    refuse("must be a motor");
  }
  if (model.actuator_ctrllimited[actuator] == 0) refuse("must have a ctrlrange");
  if (effort_per_control(model, actuator) == 0) refuse("must have a gear other than 0");
}

/// Decomposes a vector along the slides, whose axes are the world's x and z up to rounding.
void decompose(const mjModel& model, const Vector3& vector, double* along) {
  const Vector3 x_axis = world_axis(model, kBaseX);
  const Vector3 z_axis = world_axis(model, kBaseZ);
  const double determinant = x_axis[0] * z_axis[2] - x_axis[2] * z_axis[0];
  along[kBaseX] = (vector[0] * z_axis[2] - vector[2] * z_axis[0]) / determinant;
  along[kBaseZ] = (vector[2] * x_axis[0] - vector[0] * x_axis[2]) / determinant;
}

}  // namespace

std::string element_name(const mjModel& model, int type, int index) {
  const char* const name = mj_id2name(&model, type, index);
  return name != nullptr ? name : "number " + std::to_string(index);
}

ModelPointer load_planar_model(const PlanarModel& source) {
  ModelPointer model = load_model(source.xml_file);
  check_sizes(*model, source);
  check_timestep(*model, source);
  check_base(*model, source);
  for (int joint = kBaseJoints; joint < model->njnt; ++joint) check_limb(*model, source, joint);
  for (int motor = 0; motor < model->nu; ++motor) check_actuator(*model, source, motor);
  return model;
}

Layout::Layout(const mjModel& model) : trunk(model.jnt_bodyid[kBaseX]) {
  for (int i = 0; i < model.nu; ++i) {
    joints.push_back(joint_of(model, i));
    limbs.push_back(model.jnt_bodyid[joints.back()]);
  }
  const auto carries_another = [&](int body) {
    return std::any_of(limbs.begin(), limbs.end(), [&](int limb) {
      return carrier_of(model, model.body_parentid[limb]) == body;
    });
  };
  std::copy_if(limbs.begin(), limbs.end(), std::back_inserter(feet),
               [&](int limb) { return !carries_another(limb); });
}

int carrier_of(const mjModel& model, int body) { return model.body_weldid[body]; }

double effort_per_control(const mjModel& model, int actuator) {
  return at(model.actuator_gainprm, actuator, mjNGAIN)[0] * at(model.actuator_gear, actuator, 6)[0];
}

Vector3 base_origin(const mjModel& model, const double* position) {
  Vector3 origin = to_vector3(at(model.body_pos, model.jnt_bodyid[kBaseX], 3));
  for (const int slide : {kBaseX, kBaseZ}) {
    const Vector3 axis = world_axis(model, slide);
    mju_addToScl3(origin.data(), axis.data(), position[slide] - model.qpos0[slide]);
  }
  return origin;
}

void write_base_position(const mjModel& model, const Vector3& origin, const Quaternion& orientation,
                         double* position) {
  // Joints start from the model's reference pose; the pitch hinge is at the trunk's origin.
  const int trunk = model.jnt_bodyid[kBaseX];
  const mjtNum* const reference = at(model.body_pos, trunk, 3);
  decompose(model, {origin[0] - reference[0], origin[1] - reference[1], origin[2] - reference[2]},
            position);
  const std::array<mjtNum, 4> attitude{orientation[3], orientation[0], orientation[1],
                                       orientation[2]};
  std::array<mjtNum, 4> back{};
  std::array<mjtNum, 4> turn{};
  mju_negQuat(back.data(), at(model.body_quat, trunk, 4));
  mju_mulQuat(turn.data(), back.data(), attitude.data());
  position[kBasePitch] =
      2 * std::atan2(mju_dot3(&turn[1], at(model.jnt_axis, kBasePitch, 3)), turn[0]);
  for (int i = 0; i < kBaseJoints; ++i) position[i] += model.qpos0[i];
}

void write_base_velocity(const mjModel& model, const Measurements& measurements, double* velocity) {
  const Quaternion& q = measurements.orientation;
  const std::array<mjtNum, 4> to_world{q[3], q[0], q[1], q[2]};
  Vector3 in_world{};
  mju_rotVecQuat(in_world.data(), measurements.linear_velocity.data(), to_world.data());
  decompose(model, in_world, velocity);
  velocity[kBasePitch] =
      mju_dot3(measurements.angular_velocity.data(), at(model.jnt_axis, kBasePitch, 3));
}

}  // namespace walker::mujoco
