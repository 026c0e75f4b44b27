// MuJoCo's dynamics without constraints: kinematics, inertia, forces and the resulting
// accelerations (engine_core_smooth.c of MuJoCo 2.2.2).
//
//   M qacc_smooth = qfrc_smooth = -damping qvel - bias + force
//
// Inputs: qpos, qvel, force (of motors and push), the world's values. No state. Units: m, rad,
// kg, s. Spatial vectors are about the robot's centre of mass (algebra.h). MuJoCo's functions mj_*,
// in order, for a body b with parent p and a degree of freedom j with the axis e and the anchor o:
//
//   kinematics   x_b = x_p + R_p pos_b,  q_b = q_p quat_b; a slide adds (qpos - qpos0) e to x_b, a
//                hinge turns q_b by qpos - qpos0 about e and keeps the anchor in its place
//   comPos       com = sum m x / sum m;  cdof_j = (0, e) of a slide, (e, e x (com - o)) of a hinge;
//                cinert_b: inertia about com
//   crb          M_jk = cdof_k . (I_j cdof_j), k = j or an ancestor, I_j: the sum of cinert over
//                the subtree of j's body;  M_jj also has the armature
//   factorM      M = L' D L, from the last row to the first, without entries of unrelated branches
//   comVel       cvel_b = cvel_p + sum_j cdof_j qvel_j;  cdof_dot_j = cvel x cdof_j, with the cvel
//                summed before j
//   rne          cacc_b = cacc_p + sum_j cdof_dot_j qvel_j,  cacc_world = (0, -gravity);
//                cfrc_b = cinert_b cacc_b + cvel_b x* (cinert_b cvel_b) + sum of children's cfrc;
//                bias_j = cdof_j . cfrc_b
//
// The code has MuJoCo's formulas in MuJoCo's order of operations, with the model's numbers as
// constants and all loops unrolled. The walker is planar, so most factors are an exact zero or one.
// Under -fno-signed-zeros and -ffinite-math-only, the compiler drops such products; the remaining
// operations give MuJoCo's bits. MuJoCo is Copyright DeepMind Technologies Limited, licensed under
// the Apache License 2.0 (NOTICE); the functions that a part restates are named beside it.
#pragma once

#include "robots/mujoco/kernel/algebra.h"
#include "simd/vector.h"

namespace walker::mujoco::kernel::WALKER_SIM_ROBOT {
inline namespace WALKER_SIM_INSTRUCTION_SET {

/// Results that later stages read.
template <typename V>
struct Smooth {
  V M[model::nM];                 ///< joint-space inertia, in MuJoCo's sparse order
  V LD[model::nM];                ///< its factorization L'DL
  V inverse_diagonal[model::nv];  ///< inverse of D
  V qfrc_smooth[model::nv];
  V qacc_smooth[model::nv];
  V com_x, com_z;                          ///< the robot's centre of mass
  V cdof_x[model::nv], cdof_z[model::nv];  ///< cdof's translations; its rotations are constant
  V end_x[2 * kLimbs], end_z[2 * kLimbs];  ///< per capsule, in MuJoCo's order of contacts
  V centre_z[kLimbs], axis_x[kLimbs];      ///< per capsule
};

/// Poses of bodies, their inertias and joints, named as in mjData.
template <typename V>
struct Poses {
  V xpos[model::nbody][3];
  V xquat[model::nbody][4];
  V xmat[model::nbody][9];
  V xipos[model::nbody][3];
  V ximat[model::nbody][9];
  V xanchor[model::njnt][3];
  V xaxis[model::njnt][3];
};

/// mj_kinematics.
template <typename V>
WALKER_SIM_INLINE inline void kinematics(const V* qpos, Poses<V>& poses) {
  using namespace model;
  // All at once, so that the processor overlaps them: they take half of the time.
  V sine[njnt];
  V cosine[njnt];
  unrolled<njnt>([&](auto j) WALKER_SIM_INLINE {
    if constexpr (is_hinge(j)) {
      sine_and_cosine((qpos[j] - V(qpos0[j])) * V(0.5), sine[j], cosine[j]);
    }
  });
  unrolled<3>([&](auto k) WALKER_SIM_INLINE { poses.xpos[0][k] = poses.xipos[0][k] = 0.0; });
  unrolled<4>([&](auto k) WALKER_SIM_INLINE { poses.xquat[0][k] = k == 0 ? 1.0 : 0.0; });
  unrolled<9>([&](auto k) WALKER_SIM_INLINE {
    poses.xmat[0][k] = poses.ximat[0][k] = k % 4 == 0 ? 1.0 : 0.0;
  });
  unrolled<nbody - 1>([&](auto b) WALKER_SIM_INLINE {
    constexpr int body = b + 1;
    constexpr int parent = body_parentid[body];
    V pos[3];
    V quat[4];
    V arm[3];
    rotate_by_matrix(arm, body_pos[body], poses.xmat[parent]);
    unrolled<3>([&](auto k) WALKER_SIM_INLINE { pos[k] = poses.xpos[parent][k] + arm[k]; });
    multiply_quaternions(quat, poses.xquat[parent], body_quat[body]);
    unrolled<body_jntnum[body]>([&](auto jj) WALKER_SIM_INLINE {
      constexpr int j = body_jntadr[body] + jj;
      V* const anchor = poses.xanchor[j];
      V* const axis = poses.xaxis[j];
      rotate_by_quaternion(axis, jnt_axis[j], quat);
      rotate_by_quaternion(anchor, jnt_pos[j], quat);
      unrolled<3>([&](auto k) WALKER_SIM_INLINE { anchor[k] += pos[k]; });
      if constexpr (is_hinge(j)) {
        const V turn[4] = {cosine[j], V(jnt_axis[j][0]) * sine[j], V(jnt_axis[j][1]) * sine[j],
                           V(jnt_axis[j][2]) * sine[j]};
        multiply_quaternions(quat, quat, turn);
        V back[3];
        rotate_by_quaternion(back, jnt_pos[j], quat);
        // A hinge that is not at the body's origin also translates the body.
        unrolled<3>([&](auto k) WALKER_SIM_INLINE { pos[k] += (anchor[k] - pos[k]) - back[k]; });
      } else {
        const V way = qpos[j] - V(qpos0[j]);
        unrolled<3>([&](auto k) WALKER_SIM_INLINE { pos[k] += axis[k] * way; });
      }
    });
    const V inverse = V(1.0) / sqrt(quat[0] * quat[0] + quat[1] * quat[1] + quat[2] * quat[2] +
                                    quat[3] * quat[3]);
    unrolled<4>([&](auto k) WALKER_SIM_INLINE { poses.xquat[body][k] = quat[k] * inverse; });
    unrolled<3>([&](auto k) WALKER_SIM_INLINE { poses.xpos[body][k] = pos[k]; });
    to_matrix(poses.xmat[body], poses.xquat[body]);
    if constexpr (body_sameframe[body] == 1) {
      unrolled<3>([&](auto k) WALKER_SIM_INLINE { poses.xipos[body][k] = pos[k]; });
      unrolled<9>([&](auto k) WALKER_SIM_INLINE { poses.ximat[body][k] = poses.xmat[body][k]; });
    } else {
      rotate_by_matrix(poses.xipos[body], body_ipos[body], poses.xmat[body]);
      unrolled<3>([&](auto k) WALKER_SIM_INLINE { poses.xipos[body][k] += pos[k]; });
      V inertial[4];
      multiply_quaternions(inertial, poses.xquat[body], body_iquat[body]);
      to_matrix(poses.ximat[body], inertial);
    }
  });
}

/// mjc_PlaneCapsule: the capsules' ends. A capsule's frame is its body's or the inertial one.
template <typename V>
WALKER_SIM_INLINE inline void capsules(const Poses<V>& poses, Smooth<V>& out) {
  using namespace model;
  unrolled<kLimbs>([&](auto limb) WALKER_SIM_INLINE {
    constexpr int body = limb + 1;
    static_assert(geom_bodyid[body] == body && geom_sameframe[body] != 0);
    constexpr bool is_bodys = geom_sameframe[body] == 1;
    const V* const centre = is_bodys ? poses.xpos[body] : poses.xipos[body];
    const V* const matrix = is_bodys ? poses.xmat[body] : poses.ximat[body];
    const V half_x = matrix[2] * V(geom_size[body][1]);
    const V half_z = matrix[8] * V(geom_size[body][1]);
    out.end_x[2 * limb] = centre[0] + half_x;
    out.end_z[2 * limb] = centre[2] + half_z;
    out.end_x[2 * limb + 1] = centre[0] - half_x;
    out.end_z[2 * limb + 1] = centre[2] - half_z;
    out.centre_z[limb] = centre[2];
    out.axis_x[limb] = matrix[2];
  });
}

/// mj_comPos: inertias and axes of motion, about the robot's centre of mass.
template <typename V>
WALKER_SIM_INLINE inline void about_centre_of_mass(const ModelValues<V>& values,
                                                   const Poses<V>& poses, V (*cinert)[10],
                                                   V (*cdof)[6], Smooth<V>& out) {
  using namespace model;
  V com[nbody][3];
  unrolled<nbody>([&](auto body) WALKER_SIM_INLINE {
    unrolled<3>([&](auto k) WALKER_SIM_INLINE { com[body][k] = 0.0; });
  });
  unrolled_backwards<kLimbs>([&](auto limb) WALKER_SIM_INLINE {
    constexpr int body = limb + 1;
    unrolled<3>([&](auto k) WALKER_SIM_INLINE {
      com[body][k] += poses.xipos[body][k] * values.mass[limb];
      com[body_parentid[body]][k] += com[body][k];
      com[body][k] *= values.inverse_subtree_mass[limb];
    });
  });
  unrolled<nbody - 1>([&](auto b) WALKER_SIM_INLINE {
    constexpr int body = b + 1;
    V offset[3];
    unrolled<3>([&](auto k) WALKER_SIM_INLINE {
      offset[k] = poses.xipos[body][k] - com[body_rootid[body]][k];
    });
    inertia_about(cinert[body], values.inertia[b], poses.ximat[body], offset, values.mass[b]);
  });
  unrolled<njnt>([&](auto j) WALKER_SIM_INLINE {
    const V* const axis = poses.xaxis[j];
    if constexpr (is_hinge(j)) {
      V arm[3];
      unrolled<3>([&](auto k) WALKER_SIM_INLINE { arm[k] = com[1][k] - poses.xanchor[j][k]; });
      unrolled<3>([&](auto k) WALKER_SIM_INLINE { cdof[j][k] = axis[k]; });
      cdof[j][3] = axis[1] * arm[2] - axis[2] * arm[1];
      cdof[j][4] = axis[2] * arm[0] - axis[0] * arm[2];
      cdof[j][5] = axis[0] * arm[1] - axis[1] * arm[0];
    } else {
      unrolled<3>([&](auto k) WALKER_SIM_INLINE {
        cdof[j][k] = 0.0;
        cdof[j][3 + k] = axis[k];
      });
    }
    out.cdof_x[j] = cdof[j][3];
    out.cdof_z[j] = cdof[j][5];
  });
  out.com_x = com[1][0];
  out.com_z = com[1][2];
}

/// mj_crb: the joint-space inertia, from the inertias of the bodies' subtrees.
template <typename V>
WALKER_SIM_INLINE inline void composite_inertia(const V (*cinert)[10], const V (*cdof)[6], V* M) {
  using namespace model;
  V crb[nbody][10];
  unrolled<nbody - 1>([&](auto b) WALKER_SIM_INLINE {
    unrolled<10>([&](auto k) WALKER_SIM_INLINE { crb[b + 1][k] = cinert[b + 1][k]; });
  });
  unrolled_backwards<nbody - 1>([&](auto b) WALKER_SIM_INLINE {
    constexpr int parent = body_parentid[b + 1];
    if constexpr (parent > 0) {
      unrolled<10>([&](auto k) WALKER_SIM_INLINE { crb[parent][k] += crb[b + 1][k]; });
    }
  });
  unrolled_backwards<nv>([&](auto i) WALKER_SIM_INLINE {
    V momentum[6];
    multiply_inertia(momentum, crb[dof_bodyid[i]], cdof[i]);
    unrolled<depth(i)>([&](auto k) WALKER_SIM_INLINE {
      constexpr double first = k == 0 ? dof_armature[i] : 0.0;
      M[dof_Madr[i] + k] = V(first) + dot<6>(cdof[ancestor(i, k)], momentum);
    });
  });
}

/// mj_factorM. @return lanes for whose inertia MuJoCo would issue a warning
template <typename V>
WALKER_SIM_INLINE inline auto factor_inertia(V* LD, V* inverse_diagonal) {
  using namespace model;
  auto is_low = V(1.0) < V(0.0);
  unrolled_backwards<nv>([&](auto i) WALKER_SIM_INLINE {
    constexpr int diagonal = dof_Madr[i];
    is_low = is_low | (LD[diagonal] < V(kMinimum));
    unrolled<depth(i) - 1>([&](auto k) WALKER_SIM_INLINE {
      constexpr int j = ancestor(i, k + 1);
      constexpr int row = diagonal + 1 + k;
      const V ratio = LD[row] / LD[diagonal];
      unrolled<depth(j)>([&](auto c)
                             WALKER_SIM_INLINE { LD[dof_Madr[j] + c] += LD[row + c] * -ratio; });
      LD[row] = ratio;
    });
  });
  unrolled<nv>([&](auto i) WALKER_SIM_INLINE { inverse_diagonal[i] = V(1.0) / LD[dof_Madr[i]]; });
  return is_low;
}

/// mj_comVel: velocities of the bodies and of the axes of motion.
template <typename V>
WALKER_SIM_INLINE inline void velocities(const V* qvel, const V (*cdof)[6], V (*cvel)[6],
                                         V (*cdof_dot)[6]) {
  using namespace model;
  unrolled<6>([&](auto k) WALKER_SIM_INLINE { cvel[0][k] = 0.0; });
  unrolled<nbody - 1>([&](auto b) WALKER_SIM_INLINE {
    constexpr int body = b + 1;
    V* const velocity = cvel[body];
    unrolled<6>([&](auto k) WALKER_SIM_INLINE { velocity[k] = cvel[body_parentid[body]][k]; });
    unrolled<body_dofnum[body]>([&](auto jj) WALKER_SIM_INLINE {
      constexpr int j = body_dofadr[body] + jj;
      cross_motion(cdof_dot[j], velocity, cdof[j]);
      unrolled<6>([&](auto k) WALKER_SIM_INLINE { velocity[k] += cdof[j][k] * qvel[j]; });
    });
  });
}

/// mj_rne without accelerations: the bodies' Coriolis, centrifugal and gravity forces.
template <typename V>
WALKER_SIM_INLINE inline void body_forces(V gravity, const V* qvel, const V (*cinert)[10],
                                          const V (*cvel)[6], const V (*cdof_dot)[6],
                                          V (*cfrc)[6]) {
  using namespace model;
  V cacc[nbody][6];
  unrolled<5>([&](auto k) WALKER_SIM_INLINE { cacc[0][k] = 0.0; });
  cacc[0][5] = gravity * V(-1.0);
  unrolled<nbody - 1>([&](auto b) WALKER_SIM_INLINE {
    constexpr int body = b + 1;
    constexpr int first = body_dofadr[body];
    unrolled<6>([&](auto k) WALKER_SIM_INLINE {
      V sum = 0.0;
      if constexpr (body_dofnum[body] == 1) {
        sum = cdof_dot[first][k] * qvel[first];
      } else {
        unrolled<body_dofnum[body]>(
            [&](auto jj) WALKER_SIM_INLINE { sum += cdof_dot[first + jj][k] * qvel[first + jj]; });
      }
      cacc[body][k] = cacc[body_parentid[body]][k] + sum;
    });
    V momentum[6];
    V force[6];
    multiply_inertia(cfrc[body], cinert[body], cacc[body]);
    multiply_inertia(momentum, cinert[body], cvel[body]);
    cross_force(force, cvel[body], momentum);
    unrolled<6>([&](auto k) WALKER_SIM_INLINE { cfrc[body][k] += force[k]; });
  });
  unrolled_backwards<nbody - 1>([&](auto b) WALKER_SIM_INLINE {
    constexpr int parent = body_parentid[b + 1];
    if constexpr (parent > 0) {
      unrolled<6>([&](auto k) WALKER_SIM_INLINE { cfrc[parent][k] += cfrc[b + 1][k]; });
    }
  });
}

/// mj_fwdPosition to mj_fwdAcceleration, without contacts and limits.
/// @param force MuJoCo's qfrc_applied + qfrc_actuator, of which one is 0 in each element [N, N m]
/// @return lanes that the library must step
template <typename V>
auto smooth(const ModelValues<V>& values, const V* qpos, const V* qvel, const V* force,
            Smooth<V>& out) {
  using namespace model;
  Poses<V> poses;
  V cinert[nbody][10];
  V cdof[nv][6];
  kinematics(qpos, poses);
  capsules(poses, out);
  about_centre_of_mass(values, poses, cinert, cdof, out);

  V M[nM];
  V inverse_diagonal[nv];
  composite_inertia(cinert, cdof, M);
  unrolled<nM>([&](auto k) WALKER_SIM_INLINE { out.M[k] = M[k]; });
  const auto flagged = factor_inertia(M, inverse_diagonal);
  unrolled<nM>([&](auto k) WALKER_SIM_INLINE { out.LD[k] = M[k]; });
  unrolled<nv>([&](auto i) WALKER_SIM_INLINE { out.inverse_diagonal[i] = inverse_diagonal[i]; });

  V cvel[nbody][6];
  V cdof_dot[nv][6];
  V cfrc[nbody][6];
  V qacc[nv];
  velocities(qvel, cdof, cvel, cdof_dot);
  body_forces(values.gravity, qvel, cinert, cvel, cdof_dot, cfrc);
  unrolled<nv>([&](auto i) WALKER_SIM_INLINE {
    V passive = 0.0;
    if constexpr (dof_damping[i] != 0) passive -= values.damping * qvel[i];  // mj_passive
    const V bias = dot<6>(cdof[i], cfrc[dof_bodyid[i]]);
    qacc[i] = out.qfrc_smooth[i] = passive - bias + force[i];
  });
  solve_factored(qacc, M, inverse_diagonal);
  unrolled<nv>([&](auto i) WALKER_SIM_INLINE { out.qacc_smooth[i] = qacc[i]; });
  return flagged;
}

}  // namespace WALKER_SIM_INSTRUCTION_SET
}  // namespace walker::mujoco::kernel::WALKER_SIM_ROBOT
