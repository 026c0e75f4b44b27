#include "robots/mujoco/sense.h"

#include <algorithm>

#include "robots/mujoco/planar_base.h"
#include "robots/mujoco/specification.h"

namespace walker::mujoco {
namespace {

Pose pose_of_body(const mjData& data, int body) {
  return to_pose(at(data.xpos, body, 3), at(data.xquat, body, 4));
}

/// Whether the body, or one fixed to it, touches the static world.
bool touches_ground(const mjModel& model, const mjData& data, int body) {
  const auto carrier = [&model](int geom) { return carrier_of(model, model.geom_bodyid[geom]); };
  return std::any_of(data.contact, data.contact + data.ncon, [&](const mjContact& contact) {
    const int first = carrier(contact.geom1);
    const int second = carrier(contact.geom2);
    return contact.exclude == 0 &&
           ((first == body && second == 0) || (first == 0 && second == body));
  });
}

}  // namespace

void sense(const mjModel& model, const mjData& data, const Layout& layout, Sensors& sensors) {
  const std::size_t num_joints = layout.joints.size();
  sensors.joint_position.resize(num_joints);
  sensors.joint_velocity.resize(num_joints);
  sensors.joint_effort.resize(num_joints);
  sensors.link_poses.resize(num_joints + 1);
  sensors.link_poses[0] = pose_of_body(data, layout.trunk);
  for (std::size_t i = 0; i < num_joints; ++i) {
    const int dof = model.jnt_dofadr[layout.joints[i]];
    sensors.joint_position[i] = data.qpos[model.jnt_qposadr[layout.joints[i]]];
    sensors.joint_velocity[i] = data.qvel[dof];
    sensors.joint_effort[i] = data.qfrc_actuator[dof];
    sensors.link_poses[i + 1] = pose_of_body(data, layout.limbs[i]);
  }
  sensors.contacts.resize(layout.feet.size());
  std::transform(layout.feet.begin(), layout.feet.end(), sensors.contacts.begin(),
                 [&](int foot) { return touches_ground(model, data, foot) ? 1 : 0; });
  sensors.gravity = to_vector3(model.opt.gravity);
}

void sense_motion(const mjData& data, const double* velocity_before_step, double dt,
                  Sensors& sensors) {
  for (std::size_t k = 0; k < 3; ++k) {
    const auto along = [&](int joint) { return at(data.xaxis, joint, 3)[k]; };
    const auto slide = [&](const double* v) {
      return v[kBaseX] * along(kBaseX) + v[kBaseZ] * along(kBaseZ);
    };
    sensors.linear_velocity[k] = slide(data.qvel);
    sensors.linear_acceleration[k] = (slide(data.qvel) - slide(velocity_before_step)) / dt;
    sensors.angular_velocity[k] = data.qvel[kBasePitch] * along(kBasePitch);
  }
}

}  // namespace walker::mujoco
