// What a robot's kernels require of its model: the constants' structure, which is checked when they
// are compiled, and the constants themselves, with which models are compared.
#pragma once

#include <algorithm>
#include <string>

#include "base/bits.h"
#include "robots/mujoco/engine.h"
#include "robots/mujoco/kernel/kernel.h"
#include "robots/mujoco/kernel/model_fields.h"
#include WALKER_SIM_MODEL_CONSTANTS

// Constants of a model with another structure do not compile, instead of giving other results than
// the library.
namespace walker::mujoco::kernel::WALKER_SIM_ROBOT::model {

template <typename T, int N, typename Predicate>
constexpr bool all_of(const T (&values)[N], const Predicate& predicate) {
  for (int i = 0; i < N; ++i) {
    if (!predicate(values[i], i)) return false;
  }
  return true;
}

template <int N>
constexpr bool are_same(const double (&a)[N], const double (&b)[N]) {
  for (int i = 0; i < N; ++i) {
    if (a[i] != b[i]) return false;
  }
  return true;
}

constexpr auto kIsZero = [](auto value, int /*index*/) { return value == 0; };

constexpr int kLimbs = nbody - 1;

static_assert(nq <= int{kMaxCoordinates} && nu <= int{kMaxMotors} && kLimbs <= int{kMaxLimbs});
static_assert(nv == nq && njnt == nv, "joints with one coordinate each");
static_assert(nu == nv - 3 && na == 0 && kLimbs == nu + 1);
static_assert(opt_integrator == 1 && opt_solver == 2 && opt_cone == 0 && opt_collision == 1,
              "mjINT_RK4, mjSOL_NEWTON, mjCONE_PYRAMIDAL, mjCOL_PAIR");
static_assert(opt_impratio == 1 && opt_noslip_iterations == 0 && opt_disableflags == 0 &&
              opt_enableflags == 0);
static_assert(opt_density == 0 && opt_viscosity == 0, "no forces of a medium");
static_assert(neq == 0 && ntendon == 0 && nmocap == 0 && nsensor == 0 && nexclude == 0);

// Joints: two slides and a hinge of the trunk, then limited hinges, without springs and friction.
static_assert(all_of(jnt_type, [](int type, int i) { return type == (i < 2 ? 2 : 3); }));
static_assert(all_of(jnt_limited, [](int limited, int i) { return limited == (i < 3 ? 0 : 1); }));
static_assert(all_of(jnt_qposadr, [](int place, int i) { return place == i; }));
static_assert(all_of(jnt_dofadr, [](int place, int i) { return place == i; }));
static_assert(all_of(jnt_margin, kIsZero) && all_of(jnt_stiffness, kIsZero));
static_assert(all_of(dof_frictionloss, kIsZero));
static_assert(all_of(dof_damping, [](double damping, int i) {
  return damping == (i < 3 ? 0 : dof_damping[3]);
}));
static_assert(all_of(jnt_solref, [](const double (&solref)[2], int i) {
  return i < 3 || are_same(solref, jnt_solref[3]);
}));
static_assert(all_of(jnt_solimp, [](const double (&solimp)[5], int i) {
  return i < 3 || are_same(solimp, jnt_solimp[3]);
}));
static_assert(opt_gravity[0] == 0 && opt_gravity[1] == 0);

// Bodies: a trunk that carries one or two legs, each a chain of limbs.
static_assert(all_of(body_parentid, [](int parent, int i) {
  return i < 2 ? parent == 0 : parent == i - 1 || parent == 1;
}));
static_assert([] {
  int legs = 0;
  for (const int parent : body_parentid) legs += parent == 1 ? 1 : 0;
  return legs == 1 || legs == 2;
}());

// Geoms: one capsule per limb. Pairs: each limb and the floor, with friction; then pairs of limbs.
static_assert(ngeom == nbody && npair >= kLimbs);
static_assert(all_of(geom_type, [](int type, int i) { return type == (i == 0 ? 0 : 3); }));
static_assert(all_of(geom_bodyid, [](int body, int i) { return body == i; }));
static_assert(all_of(pair_geom1, [](int geom, int i) { return (geom == 0) == (i < kLimbs); }));
static_assert(all_of(pair_geom2,
                     [](int geom, int i) { return geom > 0 && (geom == i + 1 || i >= kLimbs); }));
static_assert(all_of(pair_dim, [](int size, int i) { return size == 3 || i >= kLimbs; }));
static_assert(all_of(pair_solref, [](const double (&solref)[2], int i) {
  return i >= kLimbs || are_same(solref, pair_solref[0]);
}));
static_assert(all_of(pair_solimp, [](const double (&solimp)[5], int i) {
  return i >= kLimbs || are_same(solimp, pair_solimp[0]);
}));
static_assert(all_of(pair_margin,
                     [](double margin, int i) { return i >= kLimbs || margin == pair_margin[0]; }));
static_assert(all_of(pair_gap, kIsZero));

// Motors: one per limb's hinge, in their order; mjTRN_JOINT, mjDYN_NONE, mjGAIN_FIXED, mjBIAS_NONE.
static_assert(all_of(actuator_trntype, kIsZero) && all_of(actuator_dyntype, kIsZero) &&
              all_of(actuator_gaintype, kIsZero) && all_of(actuator_biastype, kIsZero));
static_assert(all_of(actuator_ctrllimited, [](int limited, int /*i*/) { return limited == 1; }) &&
              all_of(actuator_forcelimited, kIsZero));
static_assert([] {
  for (int motor = 0; motor < nu; ++motor) {
    if (actuator_trnid[motor][0] != motor + 3 || actuator_gainprm[motor][0] != 1) return false;
  }
  return true;
}());

}  // namespace walker::mujoco::kernel::WALKER_SIM_ROBOT::model

namespace walker::mujoco::kernel::WALKER_SIM_ROBOT {

/// Compares to the bit. The model stores some integers as bytes.
inline bool is_equal(double a, double b) { return to_bits(a) == to_bits(b); }
inline bool is_equal(int a, int b) { return a == b; }

template <typename T, typename Source>
bool are_equal(const Source* values, const T* constants, std::size_t size) {
  return std::equal(constants, constants + size, values, [](T constant, Source value) {
    return is_equal(static_cast<T>(value), constant);
  });
}

/// Implements `Kernels::unsupported_reason`.
inline std::string unsupported_reason(const mjModel& model) {
#define COMPARE_COUNT(name) \
  if (model.name != model::name) return #name;
  WALKER_SIM_MODEL_COUNTS(COMPARE_COUNT)
// The upper bound limits the memory of the kernel's check, which allocates an mjData for each of
// its instances.
#define COMPARE_BUFFER(name) \
  if (model.name < model::name || model.name > 100 * model::name) return #name;
  WALKER_SIM_MODEL_BUFFERS(COMPARE_BUFFER)
#define COMPARE_NUMBER(type, part, name) \
  if (!is_equal(model.part.name, model::part##_##name)) return #part "." #name;
  WALKER_SIM_MODEL_NUMBERS(COMPARE_NUMBER)
  if (!are_equal(model.opt.gravity, model::opt_gravity, 3)) return "opt.gravity";
  if (!are_equal(model.opt.wind, model::opt_wind, 3)) return "opt.wind";
#define COMPARE_ARRAY(type, name, rows, columns)                          \
  if (!are_equal(model.name, reinterpret_cast<const type*>(&model::name), \
                 sizeof model::name / sizeof(type))) {                    \
    return #name;                                                         \
  }
  WALKER_SIM_MODEL_ARRAYS(COMPARE_ARRAY)
  // The contact's rows assume the same friction along both tangents.
  for (int pair = 0; pair < model::kLimbs; ++pair) {
    const mjtNum* const friction = at(model.pair_friction, pair, 5);
    if (!is_equal(friction[0], friction[1])) return "pair_friction";
  }
  return "";
}

}  // namespace walker::mujoco::kernel::WALKER_SIM_ROBOT
