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

/// Slots of all lanes' contacts. Each lane's fill the slots in order; those of the left leg, if
/// there is one, start at slot num_right in every lane.
struct TouchCounts {
  int num_right = 0;  ///< slots of the torso and the right leg
  int num_slots = 0;
  unsigned touching[kEnds] = {};  ///< bit mask of lanes in contact, per end of a capsule
};

template <int W>
struct Touches : TouchCounts {
  Touch<W> slots[kMaxSlots];
  int count[W] = {};

  /// Must be called before each limb's contacts are added, and with kLimbs after the last.
  WALKER_SIM_INLINE void begin(int limb) {
    if (limb != kFirstLeftLimb) return;
    num_right = num_slots;
    for (int& slots_of_lane : count) slots_of_lane = num_slots;
  }

  /// Adds a contact of a lane's limb. @return whether there is room
  WALKER_SIM_INLINE bool add(const Smooth<Vector<W>>& smooth, const ModelValues<Vector<W>>& values,
                             int limb, int lane, const LimbContact& contact) {
    if (contact.share == 0) touching[2 * limb] |= 1U << lane;
    if (contact.share == 1) touching[2 * limb + 1] |= 1U << lane;
    if (count[lane] == kMaxSlots) return false;
    const int slot = count[lane]++;
    Touch<W>& touch = slots[slot];
    if (slot == num_slots) {
      ++num_slots;
      touch.clear();
    }
    const bool is_level = contact.normal_x == 0;
    touch.distance.set(lane, contact.distance);
    touch.x.set(lane, contact.x);
    touch.z.set(lane, contact.z);
    touch.normal_x.set(lane, contact.normal_x);
    touch.normal_z.set(lane, contact.normal_z);
    touch.tangent_x.set(lane, is_level ? smooth.axis_x[limb][lane] : contact.normal_z);
    touch.tangent_z.set(lane, is_level ? 0 : -contact.normal_x);
    touch.friction.set(lane, values.friction[limb][lane]);
    touch.diagonal.set(lane, values.diagonal[limb][lane]);
    for (int dof = 0; dof < model::nv; ++dof) touch.moves[dof].set(lane, kMoves.limb[limb][dof]);
    return true;
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
  unsigned touching[kEnds];
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
      touching[end] = to_bits(~is_far & is_below);
      any_touching |= touching[end];
    });
  });
  if (any_touching == 0) return;
  for (int end = 0; end < kEnds; ++end) {
    const int limb = end / 2;
    if (end % 2 == 0) touches.begin(limb);
    for (unsigned lanes = touching[end]; lanes != 0; lanes &= lanes - 1) {
      const int lane = __builtin_ctz(lanes);
      const double radius = model::geom_size[limb + 1][0];
      const double z = smooth.end_z[end][lane];
      const double distance = z - radius;
      touches.add(smooth, values, limb, lane,
                  {distance, static_cast<double>(end % 2), smooth.end_x[end][lane],
                   z + (-distance / 2 - radius), 0, 1});
    }
  }
  touches.begin(kLimbs);
  for (int slot = 0; slot < touches.num_slots; ++slot) {
    normalize(touches.slots[slot].tangent_x, touches.slots[slot].tangent_z);
  }
}

/// mj_collision with the lines of levels, lane by lane; a lane without a level is on the floor.
/// @return lanes with more contacts than slots
template <int W>
__attribute__((noinline)) Mask<W> touch_lines(const Smooth<Vector<W>>& smooth,
                                              const ModelValues<Vector<W>>& values,
                                              const GroundLine* const* lines, Touches<W>& touches) {
  using V = Vector<W>;
  V top = 0.0;
  for (int lane = 0; lane < W; ++lane) top.set(lane, top_around(*lines[lane], smooth.com_x[lane]));
  V is_full = 0.0;
  for (int limb = 0; limb < kLimbs; ++limb) {
    touches.begin(limb);
    const int first = 2 * limb;
    const double radius = model::geom_size[limb + 1][0];
    const V limit = top + V(radius + Contacts::kMargin);
    const Mask<W> may_touch = ~(smooth.end_z[first] > limit) | ~(smooth.end_z[first + 1] > limit);
    for (unsigned lanes = to_bits(may_touch); lanes != 0; lanes &= lanes - 1) {
      const int lane = __builtin_ctz(lanes);
      LimbContact found[kMaxLimbContacts];
      const int count = find_contacts(*lines[lane],
                                      {{smooth.end_x[first][lane], smooth.end_x[first + 1][lane]},
                                       {smooth.end_z[first][lane], smooth.end_z[first + 1][lane]},
                                       smooth.centre_z[limb][lane],
                                       radius,
                                       model::geom_rbound[limb + 1]},
                                      Contacts::kMargin, found);
      for (const LimbContact* each = found; each != found + count; ++each) {
        if (!(each->distance < Contacts::kMargin)) continue;
        if (!touches.add(smooth, values, limb, lane, *each)) is_full.set(lane, 1.0);
      }
    }
  }
  touches.begin(kLimbs);
  for (int slot = 0; slot < touches.num_slots; ++slot) {  // mju_makeFrame
    Touch<W>& touch = touches.slots[slot];
    normalize(touch.normal_x, touch.normal_z);
    const V along = touch.normal_x * touch.tangent_x + touch.normal_z * touch.tangent_z;
    touch.tangent_x -= touch.normal_x * along;
    touch.tangent_z -= touch.normal_z * along;
    normalize(touch.tangent_x, touch.tangent_z);
  }
  return V(0.5) < is_full;
}

}  // namespace WALKER_SIM_INSTRUCTION_SET
}  // namespace walker::mujoco::kernel::WALKER_SIM_ROBOT
