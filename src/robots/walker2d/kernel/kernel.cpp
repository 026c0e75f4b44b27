#include "robots/walker2d/kernel/kernel.h"

#include "robots/walker2d/model_constants.h"
#include "simd/choose_kernel.h"

// Assumptions of the kernel about the model, beyond its constants. Constants of a model that
// violates them do not compile, instead of giving other results than the library.
namespace walker::walker2d::model {

template <typename T, int N, typename Predicate>
constexpr bool all_of(const T (&values)[N], const Predicate& predicate) {
  for (int i = 0; i < N; ++i) {
    if (!predicate(values[i], i)) return false;
  }
  return true;
}

constexpr auto kIsZero = [](auto value, int /*index*/) { return value == 0; };

static_assert(nq == World::kSize && nv == nq && njnt == nv, "joints with one coordinate each");
static_assert(nu == World::kMotors && na == 0 && nbody == ModelValues<double>::kLimbs + 1);
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
static_assert(opt_gravity[0] == 0 && opt_gravity[1] == 0);

// Geoms: one capsule per limb, in contact only with the floor, with friction and without a margin.
static_assert(ngeom == nbody && npair == nbody - 1);
static_assert(all_of(geom_type, [](int type, int i) { return type == (i == 0 ? 0 : 3); }));
static_assert(all_of(geom_bodyid, [](int body, int i) { return body == i; }));
static_assert(all_of(pair_geom1, kIsZero));
static_assert(all_of(pair_geom2, [](int geom, int i) { return geom == i + 1; }));
static_assert(all_of(pair_dim, [](int size, int /*i*/) { return size == 3; }));
static_assert(all_of(pair_margin, kIsZero) && all_of(pair_gap, kIsZero));

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

}  // namespace walker::walker2d::model

namespace walker::walker2d {

std::vector<const Kernel*> kernels() {
#ifdef WALKER_SIM_HAS_KERNELS
  return simd::usable_kernels<Kernel>({&kernel_avx2, &kernel_sse2});
#else
  return {};
#endif
}

}  // namespace walker::walker2d
