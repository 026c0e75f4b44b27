#include "walker2d/layout.h"

#include <algorithm>
#include <iterator>
#include <sstream>

namespace walker::walker2d {
namespace {

std::string name_of(const mjModel& model, int type, int index) {
  const char* const name = mj_id2name(&model, type, index);
  return name != nullptr ? name : "number " + std::to_string(index);
}

std::string wrong_sizes(const mjModel& model) {
  const bool fits = model.nq == kDegreesOfFreedom && model.nv == kDegreesOfFreedom &&
                    model.njnt == kDegreesOfFreedom && model.nu == kJointCount && model.na == 0;
  if (fits) return "";
  std::ostringstream text;
  text << "nq = " << model.nq << ", nv = " << model.nv << ", nu = " << model.nu
       << ", na = " << model.na << "; must be nq = nv = " << kDegreesOfFreedom
       << ", nu = " << kJointCount << ", na = 0, as in walker2d_v5.xml";
  return text.str();
}

/// Simulation time is published in whole nanoseconds and has to grow.
std::string wrong_timestep(const mjModel& model) {
  constexpr double kShortest = 1e-6;  // [s]
  if (model.opt.timestep >= kShortest) return "";
  std::ostringstream text;
  text << "timestep = " << model.opt.timestep << " s; must be at least " << kShortest << " s";
  return text.str();
}

/// Whether a joint of the trunk has the world's axis 0 (x), 1 (y) or 2 (z).
bool has_axis(const mjModel& model, int joint, std::size_t axis) {
  constexpr double kRounding = 1e-6;
  std::array<mjtNum, 3> direction{};
  mju_rotVecQuat(direction.data(), at(model.jnt_axis, joint, 3),
                 at(model.body_quat, model.jnt_bodyid[joint], 4));
  return direction[axis] > 1 - kRounding;
}

std::string wrong_root(const mjModel& model) {
  const int trunk = model.jnt_bodyid[kRootX];
  const bool is_planar =
      model.jnt_type[kRootX] == mjJNT_SLIDE && model.jnt_type[kRootZ] == mjJNT_SLIDE &&
      model.jnt_type[kRootPitch] == mjJNT_HINGE && model.jnt_bodyid[kRootZ] == trunk &&
      model.jnt_bodyid[kRootPitch] == trunk && model.body_parentid[trunk] == 0;
  if (!is_planar) {
    return "the first three joints must be the trunk's: slide (x), slide (z), hinge (pitch)";
  }
  if (!has_axis(model, kRootX, 0) || !has_axis(model, kRootZ, 2) ||
      !has_axis(model, kRootPitch, 1)) {
    return "the trunk must slide along the world's x, then z, and turn about its y";
  }
  const mjtNum* const anchor = at(model.jnt_pos, kRootPitch, 3);
  if (anchor[0] != 0 || anchor[1] != 0 || anchor[2] != 0) {
    return "joint " + name_of(model, mjOBJ_JOINT, kRootPitch) +
           ": must turn about the trunk's origin (pos 0 0 0)";
  }
  return "";
}

std::string wrong_limb(const mjModel& model, int joint) {
  const int body = model.jnt_bodyid[joint];
  if (model.jnt_type[joint] != mjJNT_HINGE || model.body_jntnum[body] != 1) {
    return "joint " + name_of(model, mjOBJ_JOINT, joint) +
           ": must be a hinge, and the only joint of its body";
  }
  if (carrier_of(model, model.body_parentid[body]) == 0) {
    return "joint " + name_of(model, mjOBJ_JOINT, joint) + ": must carry a limb of the trunk";
  }
  return "";
}

int joint_of(const mjModel& model, int actuator) {
  return at(model.actuator_trnid, actuator, 2)[0];
}

/// An effort must follow from an action, and the action's bounds from the model.
std::string wrong_actuator(const mjModel& model, int actuator) {
  const int joint = joint_of(model, actuator);
  const std::string name = "actuator " + name_of(model, mjOBJ_ACTUATOR, actuator);
  if (model.actuator_trntype[actuator] != mjTRN_JOINT || joint < kRootJoints) {
    return name + ": must drive one of the six hinges";
  }
  for (int other = 0; other < actuator; ++other) {
    if (joint_of(model, other) == joint) {
      return name + ": drives a joint that actuator " + name_of(model, mjOBJ_ACTUATOR, other) +
             " drives already";
    }
  }
  if (model.actuator_gaintype[actuator] != mjGAIN_FIXED ||
      model.actuator_biastype[actuator] != mjBIAS_NONE) {
    return name + ": must be a motor";
  }
  if (model.actuator_ctrllimited[actuator] == 0) return name + ": must have a ctrlrange";
  if (effort_per_control(model, actuator) == 0) return name + ": must have a gear other than 0";
  return "";
}

}  // namespace

std::string describe_misfit(const mjModel& model) {
  std::string misfit = wrong_sizes(model);
  if (misfit.empty()) misfit = wrong_timestep(model);
  if (misfit.empty()) misfit = wrong_root(model);
  for (int joint = kRootJoints; misfit.empty() && joint < kDegreesOfFreedom; ++joint) {
    misfit = wrong_limb(model, joint);
  }
  for (int actuator = 0; misfit.empty() && actuator < kJointCount; ++actuator) {
    misfit = wrong_actuator(model, actuator);
  }
  return misfit;
}

Layout::Layout(const mjModel& model) : trunk(model.jnt_bodyid[kRootX]) {
  for (int i = 0; i < kJointCount; ++i) joints[i] = joint_of(model, i);
  std::transform(joints.begin(), joints.end(), limbs.begin(),
                 [&model](int joint) { return model.jnt_bodyid[joint]; });
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

}  // namespace walker::walker2d
