// MuJoCo's step with its fourth-order Runge-Kutta integrator (engine_forward.c of MuJoCo 2.2.2; see
// smooth.h). A group has one instance per lane of a vector.
//
// The state is qpos q and qvel v; a(q, v) are the accelerations of mj_forward (`Forward`) under
// constant force. With h = opt.timestep [s]:
//
//   stage 1  q1 = q,             v1 = v,             a1 = a(q1, v1)
//   stage 2  q2 = q + h/2 v1,    v2 = v + h/2 a1,    a2 = a(q2, v2)
//   stage 3  q3 = q + h/2 v2,    v3 = v + h/2 a2,    a3 = a(q3, v3)
//   stage 4  q4 = q + h v3,      v4 = v + h a3,      a4 = a(q4, v4)
//   result   q += h (v1/6 + v2/3 + v3/3 + v4/6),   v += h (a1/6 + a2/3 + a3/3 + a4/6)
//
// The solver of each stage starts from the accelerations of the stage before, in stage 1 from a4 of
// the last step: qacc_warmstart is part of the state.
#pragma once

#include <new>
#include <type_traits>

#include "robots/mujoco/kernel/kernel.h"
#include "robots/mujoco/kernel/limb_contacts.h"
#include "robots/mujoco/kernel/solver.h"
#include "simd/lane_memory.h"

namespace walker::mujoco::kernel::WALKER_SIM_ROBOT {
inline namespace WALKER_SIM_INSTRUCTION_SET {

/// Number of groups that run a stage in turn, so that its code (10 to 25 kB) stays in the cache.
constexpr int kGroups = 4;
constexpr double kMaxValue = 1e10;  ///< mjMAXVAL: a state with a larger value is bad

/// MuJoCo's qpos, qvel, qacc_warmstart, qfrc_applied + qfrc_actuator, and the models' values of a
/// group.
template <int W>
struct Group {
  Vector<W> qpos[model::nq];
  Vector<W> qvel[model::nv];
  Vector<W> warm_start[model::nv];
  Vector<W> force[model::nv];
  ModelValues<Vector<W>> values;
  const GroundLine* lines[W];
  bool has_lines;
  Mask<W> flagged;
  unsigned pattern[W];
};

template <int W>
WALKER_SIM_INLINE inline Mask<W> is_bad(const Vector<W>* values) {
  Mask<W> bad = Mask<W>::none();
  unrolled<model::nv>([&](auto i) WALKER_SIM_INLINE { bad = bad | exceeds(values[i], kMaxValue); });
  return bad;
}

/// mj_forward and its working memory, for up to kGroups groups.
template <int W>
class Forward {
 public:
  /// @param qpos, qvel of each group
  /// @param groups     receive the accelerations as their warm starts
  void run(int count, const Vector<W> (*qpos)[model::nq], const Vector<W> (*qvel)[model::nv],
           Group<W>* groups) {
    for (int g = 0; g < count; ++g) {
      groups[g].flagged = groups[g].flagged |
                          smooth(groups[g].values, qpos[g], qvel[g], groups[g].force, smooth_[g]);
    }
    if constexpr (model::npair > kLimbs) {
      for (int g = 0; g < count; ++g) {
        groups[g].flagged = groups[g].flagged | find_limbs_that_meet<W>(smooth_[g]);
      }
    }
    for (int g = 0; g < count; ++g) {
      Group<W>& group = groups[g];
      group.flagged = group.flagged | make_rows(smooth_[g], group.values,
                                                group.has_lines ? group.lines : nullptr, qpos[g],
                                                qvel[g], rows_[g]);
    }
    for (int g = 0; g < count; ++g) {
      Group<W>& group = groups[g];
      if (any(rows_[g].has_any)) {
        Solver<W> solver(smooth_[g], group.values.mean_inertia, rows_[g]);
        solver.solve(group.warm_start);
      } else {
        unrolled<model::nv>(
            [&](auto i) WALKER_SIM_INLINE { group.warm_start[i] = smooth_[g].qacc_smooth[i]; });
      }
    }
  }

  const Rows<W>& rows(int group) const { return rows_[group]; }

 private:
  Smooth<Vector<W>> smooth_[kGroups];
  Rows<W> rows_[kGroups];
};

/// Working memory of a call.
template <int W, int Groups>
struct Work {
  Group<W> groups[Groups];
  Forward<W> forward;
};

template <int W, int Groups>
Work<W, Groups>& new_work() {
  using Made = Work<W, Groups>;
  static_assert(sizeof(Made) <= simd::LaneMemory::kLanesSize);
  static_assert(alignof(Made) <= simd::LaneMemory::kAlignment);
  static_assert(std::is_trivially_destructible_v<Made>);
  return *new (simd::lane_memory().lanes) Made;
}

template <int W>
WALKER_SIM_INLINE inline Vector<W> add_product(Vector<W> a, Vector<W> b, Vector<W> c) {
#ifdef WALKER_SIM_FUSE_ADD  // a test checks that this is detected
  for (int lane = 0; lane < W; ++lane) a.set(lane, __builtin_fma(b[lane], c[lane], a[lane]));
  return a;
#else
  return a + b * c;
#endif
}

/// mj_step, mj_RungeKutta.
template <int W>
void step_groups(int count, Group<W>* groups, Forward<W>& forward) {
  using V = Vector<W>;
  constexpr int kStages = 4;
  constexpr double kShares[kStages] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};
  const V h = model::opt_timestep;
  V qpos[kGroups][model::nq];
  V qvel[kStages][kGroups][model::nv];
  V qacc[kStages][kGroups][model::nv];
  for (int g = 0; g < count; ++g) {
    Group<W>& group = groups[g];
    group.flagged = group.flagged | is_bad(group.qpos) | is_bad(group.qvel);
    unrolled<model::nv>([&](auto i) WALKER_SIM_INLINE {
      qpos[g][i] = group.qpos[i];
      qvel[0][g][i] = group.qvel[i];
    });
  }
  for (int stage = 0; stage < kStages; ++stage) {
    if (stage > 0) {
      const V part = stage < 3 ? 0.5 : 1.0;
      for (int g = 0; g < count; ++g) {
        unrolled<model::nv>([&](auto i) WALKER_SIM_INLINE {
          qpos[g][i] = groups[g].qpos[i] + h * (qvel[stage - 1][g][i] * part);
          qvel[stage][g][i] = qvel[0][g][i] + (qacc[stage - 1][g][i] * part) * h;
        });
      }
    }
    forward.run(count, qpos, qvel[stage], groups);
    for (int g = 0; g < count; ++g) {
      Group<W>& group = groups[g];
      unrolled<model::nv>([&](auto i)
                              WALKER_SIM_INLINE { qacc[stage][g][i] = group.warm_start[i]; });
      // mj_checkAcc checks the first stage only. Checking all flags non-finite values in any stage.
      group.flagged = group.flagged | is_bad(group.warm_start);
    }
  }
  for (int g = 0; g < count; ++g) {
    unrolled<model::nv>([&](auto i) WALKER_SIM_INLINE {
      V dx = qvel[0][g][i] * V(kShares[0]);
      V dv = qacc[0][g][i] * V(kShares[0]);
      unrolled<kStages - 1>([&](auto s) WALKER_SIM_INLINE {
        dx += qvel[s + 1][g][i] * V(kShares[s + 1]);
        dv += qacc[s + 1][g][i] * V(kShares[s + 1]);
      });
      groups[g].qvel[i] = add_product(groups[g].qvel[i], dv, h);
      groups[g].qpos[i] = groups[g].qpos[i] + h * dx;
    });
  }
}

/// Sets one lane of each of the model's values.
template <int W>
WALKER_SIM_INLINE inline void load(const ModelValues<double>& from, int lane,
                                   ModelValues<Vector<W>>& to) {
  constexpr int kCount = sizeof from / sizeof(double);
  static_assert(sizeof to == kCount * sizeof(Vector<W>));
  const auto* const numbers = reinterpret_cast<const double*>(&from);
  auto* const vectors = reinterpret_cast<Vector<W>*>(&to);
  for (int i = 0; i < kCount; ++i) vectors[i].set(lane, numbers[i]);
}

/// Loads instances into lanes; excess lanes repeat the last instance.
template <int W>
void load(Instance* const* instances, int count, Group<W>& group) {
  group.flagged = Mask<W>::none();
  group.has_lines = false;
  for (int lane = 0; lane < W; ++lane) {
    const Instance& instance = *instances[lane < count ? lane : count - 1];
    group.lines[lane] = instance.line != nullptr ? instance.line : &flat_floor();
    group.has_lines |= instance.line != nullptr;
    for (int i = 0; i < model::nv; ++i) {
      group.qpos[i].set(lane, instance.position[i]);
      group.qvel[i].set(lane, instance.velocity[i]);
      group.warm_start[i].set(lane, instance.warm_start[i]);
      group.force[i].set(lane, i < kFirstLimited ? 0 : instance.torque[i - kFirstLimited]);
    }
    for (int i = 0; i < 2; ++i) group.force[i].set(lane, instance.push[i]);
    load(*instance.values, lane, group.values);
  }
}

/// Flags instances with a zero: its sign is undefined in the kernel, but defined in the library.
template <int W>
void store(Group<W>& group, const Rows<W>& rows, int count, Instance* const* instances) {
  Mask<W> flagged = group.flagged | is_bad(group.qpos) | is_bad(group.qvel);
  unrolled<model::nv>([&](auto i) WALKER_SIM_INLINE {
    flagged =
        flagged | is_zero(group.qpos[i]) | is_zero(group.qvel[i]) | is_zero(group.warm_start[i]);
  });
  const unsigned bits = to_bits(flagged);
  for (int lane = 0; lane < count; ++lane) {
    Instance& instance = *instances[lane];
    for (int i = 0; i < model::nv; ++i) {
      instance.position[i] = group.qpos[i][lane];
      instance.velocity[i] = group.qvel[i][lane];
      instance.warm_start[i] = group.warm_start[i][lane];
    }
    instance.pattern = pattern(rows, lane);
    instance.is_flagged = (bits >> lane & 1U) != 0;
  }
}

template <int W>
void step_instances(Instance* const* instances, std::size_t count, int steps) {
  constexpr std::size_t kMax = std::size_t{W} * kGroups;
  auto& [groups, forward] = new_work<W, kGroups>();
  while (count > 0) {
    const int num_instances = static_cast<int>(count < kMax ? count : kMax);
    const int num_groups = (num_instances + W - 1) / W;
    const auto instances_of = [&](int g) { return instances + std::ptrdiff_t{g} * W; };
    const auto size = [&](int g) { return g + 1 < num_groups ? W : num_instances - g * W; };
    for (int g = 0; g < num_groups; ++g) load(instances_of(g), size(g), groups[g]);
    for (int i = 0; i < steps; ++i) step_groups(num_groups, groups, forward);
    for (int g = 0; g < num_groups; ++g) {
      store(groups[g], forward.rows(g), size(g), instances_of(g));
    }
    instances += num_instances;
    count -= static_cast<std::size_t>(num_instances);
  }
}

/// mj_forward without torques and push.
inline void start_instance(Instance& instance) {
  Instance* const instances[] = {&instance};
  auto& [groups, forward] = new_work<1, 1>();
  Group<1>& group = groups[0];
  instance.warm_start = {};
  instance.torque = {};
  instance.push = {};
  load(instances, 1, group);
  forward.run(1, &group.qpos, &group.qvel, &group);
  group.flagged = group.flagged | is_bad(group.warm_start);
  store(group, forward.rows(0), 1, instances);
}

/// @tparam W instances that the kernel solves together
template <int W>
constexpr Kernel make_kernel(const char* instruction_set) {
  return {instruction_set, W, step_instances<W>, step_instances<1>, start_instance};
}

}  // namespace WALKER_SIM_INSTRUCTION_SET
}  // namespace walker::mujoco::kernel::WALKER_SIM_ROBOT
