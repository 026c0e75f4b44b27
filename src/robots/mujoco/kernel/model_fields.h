// Every field of mjModel that mj_step reads for bodies, joints, capsules, pairs and motors. The
// kernel's constants are generated from this list, and models are compared with them.
//
// Excluded: names, visuals, fields of elements that the model does not have (their counts are
// included), and the floor's friction, which differs between models. Included are fields that only
// worlds change (ModelValues in kernel.h): the base model has these numbers.
#pragma once

// clang-format off

// X(field)
#define WALKER_SIM_MODEL_COUNTS(X)                                                               \
  X(nq) X(nv) X(nu) X(na) X(nbody) X(njnt) X(ngeom) X(nM) X(npair) X(nexclude) X(neq) X(ntendon) \
  X(nmocap) X(nsensor) X(nmesh) X(nhfield) X(nskin) X(nuserdata)

// X(field): sizes of MuJoCo's buffers, which must not overflow in the library
#define WALKER_SIM_MODEL_BUFFERS(X) X(nconmax) X(njmax) X(nstack)

// X(type, struct, field): options and statistics of mjModel
#define WALKER_SIM_MODEL_NUMBERS(X)                                                           \
  X(double, opt, timestep) X(double, opt, impratio) X(double, opt, tolerance)                 \
  X(double, opt, density) X(double, opt, viscosity) X(int, opt, integrator)                   \
  X(int, opt, collision) X(int, opt, cone) X(int, opt, jacobian) X(int, opt, solver)          \
  X(int, opt, iterations) X(int, opt, noslip_iterations) X(int, opt, disableflags)            \
  X(int, opt, enableflags) X(double, stat, meaninertia)

// X(type, field, rows, columns)
#define WALKER_SIM_MODEL_ARRAYS(X)                                                               \
  X(double, qpos0, nq, 1) X(double, qpos_spring, nq, 1)                                          \
  X(int, body_parentid, nbody, 1) X(int, body_rootid, nbody, 1) X(int, body_weldid, nbody, 1)    \
  X(int, body_mocapid, nbody, 1) X(int, body_jntnum, nbody, 1) X(int, body_jntadr, nbody, 1)     \
  X(int, body_dofnum, nbody, 1) X(int, body_dofadr, nbody, 1) X(int, body_sameframe, nbody, 1)   \
  X(double, body_pos, nbody, 3) X(double, body_quat, nbody, 4) X(double, body_ipos, nbody, 3)    \
  X(double, body_iquat, nbody, 4) X(double, body_mass, nbody, 1)                                 \
  X(double, body_subtreemass, nbody, 1) X(double, body_inertia, nbody, 3)                        \
  X(double, body_invweight0, nbody, 2)                                                           \
  X(int, jnt_type, njnt, 1) X(int, jnt_qposadr, njnt, 1) X(int, jnt_dofadr, njnt, 1)             \
  X(int, jnt_bodyid, njnt, 1) X(int, jnt_limited, njnt, 1) X(double, jnt_solref, njnt, 2)        \
  X(double, jnt_solimp, njnt, 5) X(double, jnt_pos, njnt, 3) X(double, jnt_axis, njnt, 3)        \
  X(double, jnt_stiffness, njnt, 1) X(double, jnt_range, njnt, 2) X(double, jnt_margin, njnt, 1) \
  X(int, dof_bodyid, nv, 1) X(int, dof_parentid, nv, 1) X(int, dof_Madr, nv, 1)                  \
  X(double, dof_frictionloss, nv, 1) X(double, dof_armature, nv, 1)                              \
  X(double, dof_damping, nv, 1) X(double, dof_invweight0, nv, 1)                                 \
  X(int, geom_type, ngeom, 1) X(int, geom_bodyid, ngeom, 1) X(int, geom_sameframe, ngeom, 1)     \
  X(double, geom_size, ngeom, 3) X(double, geom_rbound, ngeom, 1) X(double, geom_pos, ngeom, 3)  \
  X(double, geom_quat, ngeom, 4)                                                                 \
  X(int, pair_dim, npair, 1) X(int, pair_geom1, npair, 1) X(int, pair_geom2, npair, 1)           \
  X(double, pair_solref, npair, 2) X(double, pair_solimp, npair, 5)                              \
  X(double, pair_margin, npair, 1) X(double, pair_gap, npair, 1)                                 \
  X(int, actuator_trntype, nu, 1) X(int, actuator_dyntype, nu, 1)                                \
  X(int, actuator_gaintype, nu, 1) X(int, actuator_biastype, nu, 1)                              \
  X(int, actuator_trnid, nu, 2) X(int, actuator_ctrllimited, nu, 1)                              \
  X(int, actuator_forcelimited, nu, 1) X(double, actuator_gainprm, nu, 10)                       \
  X(double, actuator_biasprm, nu, 10) X(double, actuator_ctrlrange, nu, 2)                       \
  X(double, actuator_gear, nu, 6)
// clang-format on
