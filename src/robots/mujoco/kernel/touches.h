// Contacts of a robot's limbs with the floor or with a level's line, lane by lane: MuJoCo's
// mj_collision for predefined pairs (engine_collision_driver.c of MuJoCo 2.2.2; see smooth.h).
//
//   floor   mjc_PlaneCapsule: a contact at each end of a capsule below the floor; all lanes at once
//             distance  d = end_z - radius
//             point     (end_x, end_z - d / 2 - radius)
//             frame     normal (0, 1), tangent: the capsule's axis, projected and normalized
//   line    `find_contacts`, limb by limb: scalar code, which the library's steps use too.
//           Limbs above `top_around` are left out.
//
// Inputs: the capsules' ends and axes of smooth.h. No state.
#pragma once

#include "robots/mujoco/kernel/kernel.h"
#include "robots/mujoco/kernel/smooth.h"

namespace walker::mujoco::kernel::WALKER_SIM_ROBOT {
inline namespace WALKER_SIM_INSTRUCTION_SET {

constexpr int kEnds = 2 * kLimbs;     ///< ends of capsules, where contacts are
constexpr int kMaxSlots = kEnds + 6;  ///< more contacts the library solves

/// The left leg's first limb, the trunk's second child; kLimbs if there is one leg.
constexpr int kFirstLeftLimb = [] {
  int limb = 2;  // the first are the trunk and its first child
  while (limb < kLimbs && model::body_parentid[limb + 1] != 1) ++limb;
  return limb;
}();
constexpr bool kHasLeftLeg = kFirstLeftLimb < kLimbs;

/// getsolparam: parameters of all contacts with the floor.
struct Contacts {
  static constexpr const double* kSolref = model::pair_solref[0];
  static constexpr const double* kSolimp = model::pair_solimp[0];
  static constexpr double kMargin = model::pair_margin[0];
};

/// 1 for each degree of freedom that moves a limb, else 0.
inline constexpr auto kMoves = [] {
  struct {
    double limb[kLimbs][model::nv];
  } moves{};
  for (int limb = 0; limb < kLimbs; ++limb) {
    const int body = limb + 1;
    int dof = model::body_dofadr[body] + model::body_dofnum[body] - 1;
    for (; dof >= 0; dof = model::dof_parentid[dof]) moves.limb[limb][dof] = 1;
  }
  return moves;
}();

/// Geometry and friction of a slot's contacts, one per lane.
template <int W>
struct Touch {
  Vector<W> distance, x, z;                            ///< of the contact's point
  Vector<W> normal_x, normal_z, tangent_x, tangent_z;  ///< axes of its frame
  Vector<W> friction, diagonal;
  Vector<W> moves[model::nv];  ///< 1 if the degree of freedom moves the capsule, else 0

  void clear() {
    distance = x = z = normal_x = tangent_z = 0.0;
    normal_z = tangent_x = friction = diagonal = 1.0;
    for (Vector<W>& each : moves) each = 0.0;
  }
};

/// The contacts of all lanes. Each lane's fill the slots in order; those of the left leg, if there
/// is one, start at slot num_right in every lane.
template <int W>
struct Touches {
  int num_right = 0;  ///< slots of the torso and the right leg
  int num_slots = 0;
  unsigned touching[kEnds] = {};           ///< bit mask of lanes in contact, per end of a capsule
  Mask<W> has_too_many = Mask<W>::none();  ///< lanes with more contacts than slots
  Touch<W> slots[kMaxSlots];
  int count[W] = {};

  /// Must be called for each limb, before its contacts are added.
  WALKER_SIM_INLINE void begin(int limb) {
    if (limb != kFirstLeftLimb) return;
    num_right = num_slots;
    for (int& slots_of_lane : count) slots_of_lane = num_slots;
  }

  WALKER_SIM_INLINE void end() {
    if constexpr (!kHasLeftLeg) num_right = num_slots;
  }

  /// Returns the next slot of a lane; null if it has no more.
  WALKER_SIM_INLINE Touch<W>* add(const ModelValues<Vector<W>>& values, int limb, int lane) {
    if (count[lane] == kMaxSlots) return nullptr;
    const int slot = count[lane]++;
    Touch<W>& touch = slots[slot];
    if (slot == num_slots) {
      ++num_slots;
      touch.clear();
    }
    touch.friction.set(lane, values.friction[limb][lane]);
    touch.diagonal.set(lane, values.diagonal[limb][lane]);
    for (int dof = 0; dof < model::nv; ++dof) touch.moves[dof].set(lane, kMoves.limb[limb][dof]);
    return &touch;
  }
};

/// mju_normalize3 in the plane of motion.
template <typename V>
WALKER_SIM_INLINE inline void normalize(V& x, V& z) {
  const V length = sqrt(x * x + z * z);
  const auto is_zero = length < V(kMinimum);
  x = select(is_zero, V(1.0), x * (V(1.0) / length));
  z = select(is_zero, V(0.0), z * (V(1.0) / length));
}

/// mj_collision for predefined pairs, mjc_PlaneCapsule: finds the capsules' ends below the floor.
template <int W>
WALKER_SIM_INLINE inline void touch_floor(const Smooth<Vector<W>>& smooth,
                                          const ModelValues<Vector<W>>& values,
                                          Touches<W>& touches) {
  using V = Vector<W>;
  unsigned any_touching = 0;
  unrolled<kLimbs>([&](auto limb) WALKER_SIM_INLINE {
    constexpr double reach = Contacts::kMargin + model::geom_rbound[limb + 1];
    const Mask<W> is_far = smooth.centre_z[limb] > V(reach);
    unrolled<2>([&](auto side) WALKER_SIM_INLINE {
      constexpr int end = 2 * limb + side;
      const V depth = smooth.end_z[end] - V(model::geom_size[limb + 1][0]);
      Mask<W> is_below = depth < V(Contacts::kMargin);
      if constexpr (Contacts::kMargin != 0) {  // rounding may decide MuJoCo's two tests differently
        is_below =
            is_below & ~(smooth.end_z[end] > V(Contacts::kMargin + model::geom_size[limb + 1][0]));
      }
      touches.touching[end] = to_bits(~is_far & is_below);
      any_touching |= touches.touching[end];
    });
  });
  if (any_touching == 0) return;
  for (int end = 0; end < kEnds; ++end) {
    const int limb = end / 2;
    if (end % 2 == 0) touches.begin(limb);
    for (unsigned lanes = touches.touching[end]; lanes != 0; lanes &= lanes - 1) {
      const int lane = __builtin_ctz(lanes);
      Touch<W>& touch = *touches.add(values, limb, lane);
      touch.x.set(lane, smooth.end_x[end][lane]);
      touch.z.set(lane, smooth.end_z[end][lane]);
      touch.distance.set(lane, model::geom_size[limb + 1][0]);
      touch.tangent_x.set(lane, smooth.axis_x[limb][lane]);
    }
  }
  touches.end();
  for (int slot = 0; slot < touches.num_slots; ++slot) {
    Touch<W>& touch = touches.slots[slot];
    const V radius = touch.distance;
    touch.distance = touch.z - radius;
    touch.z = touch.z + (-touch.distance / V(2.0) - radius);
    normalize(touch.tangent_x, touch.tangent_z);
  }
}

/// Adds the contacts of a lane's limb with the line. @return whether there is room for all
template <int W>
inline bool touch_line(const Smooth<Vector<W>>& smooth, const ModelValues<Vector<W>>& values,
                       const GroundLine& line, int limb, int lane, Touches<W>& touches) {
  const int first = 2 * limb;
  LimbContact found[kMaxLimbContacts];
  const int count = find_contacts(line,
                                  {{smooth.end_x[first][lane], smooth.end_x[first + 1][lane]},
                                   {smooth.end_z[first][lane], smooth.end_z[first + 1][lane]},
                                   smooth.centre_z[limb][lane],
                                   model::geom_size[limb + 1][0],
                                   model::geom_rbound[limb + 1]},
                                  Contacts::kMargin, found);
  for (int i = 0; i < count; ++i) {
    const LimbContact& each = found[i];
    if (!(each.distance < Contacts::kMargin)) continue;
    if (each.share == 0) touches.touching[first] |= 1U << lane;
    if (each.share == 1) touches.touching[first + 1] |= 1U << lane;
    Touch<W>* const touch = touches.add(values, limb, lane);
    if (touch == nullptr) return false;
    const bool is_level = each.normal_x == 0;
    touch->distance.set(lane, each.distance);
    touch->x.set(lane, each.x);
    touch->z.set(lane, each.z);
    touch->normal_x.set(lane, each.normal_x);
    touch->normal_z.set(lane, each.normal_z);
    touch->tangent_x.set(lane, is_level ? smooth.axis_x[limb][lane] : each.normal_z);
    touch->tangent_z.set(lane, is_level ? 0 : -each.normal_x);
  }
  return true;
}

/// mj_collision with the lines of levels, lane by lane; a lane without a level is on the floor.
template <int W>
__attribute__((noinline)) void touch_lines(const Smooth<Vector<W>>& smooth,
                                           const ModelValues<Vector<W>>& values,
                                           const GroundLine* const* lines, Touches<W>& touches) {
  using V = Vector<W>;
  V top = 0.0;
  for (int lane = 0; lane < W; ++lane) top.set(lane, top_around(*lines[lane], smooth.com_x[lane]));
  V is_full = 0.0;
  for (int limb = 0; limb < kLimbs; ++limb) {
    touches.begin(limb);
    const V limit = top + V(model::geom_size[limb + 1][0] + Contacts::kMargin);
    const Mask<W> may_touch =
        ~(smooth.end_z[2 * limb] > limit) | ~(smooth.end_z[2 * limb + 1] > limit);
    for (unsigned lanes = to_bits(may_touch); lanes != 0; lanes &= lanes - 1) {
      const int lane = __builtin_ctz(lanes);
      if (!touch_line(smooth, values, *lines[lane], limb, lane, touches)) is_full.set(lane, 1.0);
    }
  }
  touches.end();
  touches.has_too_many = V(0.5) < is_full;
  for (int slot = 0; slot < touches.num_slots; ++slot) {  // mju_makeFrame
    Touch<W>& touch = touches.slots[slot];
    normalize(touch.normal_x, touch.normal_z);
    const V along = touch.normal_x * touch.tangent_x + touch.normal_z * touch.tangent_z;
    touch.tangent_x -= touch.normal_x * along;
    touch.tangent_z -= touch.normal_z * along;
    normalize(touch.tangent_x, touch.tangent_z);
  }
}

}  // namespace WALKER_SIM_INSTRUCTION_SET
}  // namespace walker::mujoco::kernel::WALKER_SIM_ROBOT
