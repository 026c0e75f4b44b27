// Joint limits and contacts of capsules with the floor or a level, as the solver's constraint rows
// (engine_core_constraint.c and engine_collision_primitive.c of MuJoCo 2.2.2; see smooth.h).
//
// A row has the Jacobian J and the violation d < 0 (distance minus margin) [m or rad]. Its cost in
// the solver depends on J a - aref and D:
//
//   impedance  s = d0 + y (d1 - d0),  x = |d| / width [solimp: d0, d1, width, mid, p]
//              y = x^p / mid^(p-1) if x <= mid, 1 - (1-x)^p / (1-mid)^(p-1) up to x = 1, then 1
//   aref       = -b J qvel - k s d,   b = 2 / (d1 timeconst),
//              k = 1 / (d1 timeconst dampratio)^2         [solref: timeconst, dampratio]
//   D          = 1 / R,   R = A (1 - s) / s               A: approximation of J M^-1 J'
//   limit      d = qpos - low, J = 1, or d = high - qpos, J = -1;  A = dof_invweight0
//   contact    d = distance - margin;  J = J_n +- mu J_t along normal and tangent;
//              A = w + mu^2 w, w: sum of both bodies' invweight0;  its rows have 2 mu^2 R for R
//
// touches.h finds the contacts, with their points and frames. Per unit of velocity, a hinge moves a
// point by cdof's translation + axis x (point - com), a slide by its axis. Inputs: qpos, qvel and
// smooth.h's results. No state.
//
// Each lane has its own rows. A limit or slot that a lane does not have is a row of zeros in it,
// which adds exact zeros to every sum. A contact has four rows, normal +- friction times each
// tangent. The second tangent is perpendicular to the plane of motion, so rows 2 and 3 are equal:
// they are computed once and counted twice. Contacts between limbs have no rows (limb_contacts.h).
#pragma once

#include "robots/mujoco/kernel/kernel.h"
#include "robots/mujoco/kernel/smooth.h"
#include "robots/mujoco/kernel/touches.h"

namespace walker::mujoco::kernel::WALKER_SIM_ROBOT {
inline namespace WALKER_SIM_INSTRUCTION_SET {

constexpr int kLimits = model::njnt - 3;  ///< joints with limits
constexpr int kFirstLimited = 3;
constexpr int kRows = 3;  ///< distinct rows of a contact

constexpr int kFirstLeftDof = kFirstLeftLimb + 2;

/// Limits and contacts of all lanes.
template <int W>
struct Rows : TouchCounts {
  using V = Vector<W>;

  /// A joint limit and the solver's data for it.
  struct Limit {
    int dof;
    unsigned lanes;  ///< bit mask of lanes beyond the limit
    V jacobian;      ///< 1 or -1; 0 in other lanes
    V D;             ///< inverse of the regularisation
    V reference;     ///< MuJoCo's aref: acceleration of the spring and damper
    V residual;      ///< MuJoCo's jar: the row's acceleration minus the reference
    V direction;     ///< MuJoCo's jv: the row times the search direction
    V quadratic[3];  ///< its cost along the search: coefficients by power
    Mask<W> is_active;
  };

  /// A contact. Its rows share D; the members are those of a limit.
  struct Slot {
    V jacobian[kRows][model::nv];
    V D;
    V reference[kRows];
    V residual[kRows];
    V direction[kRows];
    V quadratic[kRows][3];
    Mask<W> is_active[kRows];
  };

  int num_limits = 0;
  Mask<W> has_any;
  Limit limits[kLimits];
  Slot slots[kMaxSlots];

  /// Calls function(side, slot). The side is a constant: 0 for torso and right leg, 1 for left leg.
  template <typename Function>
  WALKER_SIM_INLINE void for_each_slot(const Function& function) {
    int k = 0;
    for (; k < num_right; ++k) function(std::integral_constant<int, 0>{}, slots[k]);
    if constexpr (kHasLeftLeg) {
      for (; k < num_slots; ++k) function(std::integral_constant<int, 1>{}, slots[k]);
    }
  }
};

/// Whether an element of a Jacobian may be non-zero. Only the trunk's joints and those of the
/// slot's leg move a contact.
constexpr bool has_column(int side, int dof) {
  return dof < 3 || (dof < kFirstLeftDof) == (side == 0);
}

template <int Side, int Row, typename V>
WALKER_SIM_INLINE inline void read_row(const V (&jacobian)[kRows][model::nv], V* row) {
  unrolled<model::nv>([&](auto dof) WALKER_SIM_INLINE {
    if constexpr (has_column(Side, dof)) {
      row[dof] = jacobian[Row][dof];
    } else {
      row[dof] = 0.0;
    }
  });
}

template <int Side, int Row, typename V>
WALKER_SIM_INLINE inline V row_times(const V (&jacobian)[kRows][model::nv], const V* vector) {
  V row[model::nv];
  read_row<Side, Row>(jacobian, row);
  return dot<model::nv>(row, vector);
}

/// getsolparam: parameters of all limits.
struct Limits {
  static constexpr const double* kSolref = model::jnt_solref[kFirstLimited];
  static constexpr const double* kSolimp = model::jnt_solimp[kFirstLimited];
};

template <typename Of>
constexpr double kStiffness = 1 / (Of::kSolimp[1] * Of::kSolimp[1] * Of::kSolref[0] *
                                   Of::kSolref[0] * Of::kSolref[1] * Of::kSolref[1]);
template <typename Of>
constexpr double kDamping = 2 / (Of::kSolimp[1] * Of::kSolref[0]);

/// Calls the C library's pow. GCC would fold pow(x, 2.0) to x * x, which differs from the library's
/// result for one x in a thousand, so the exponent is hidden from it.
inline double library_pow(double x, double exponent) {
#ifdef WALKER_SIM_FOLD_POW  // a test checks that this is detected
  return exponent == 1 ? x : x * x;
#else
  asm("" : "+m"(exponent));
  return __builtin_pow(x, exponent);
#endif
}

/// Impedance for x between 0 and 1, where x is the violation in units of the width.
template <typename Of>
inline double impedance_within(double x) {
  constexpr const double* kSolimp = Of::kSolimp;
  constexpr double kMiddle = kSolimp[3];
  constexpr double kPower = kSolimp[4];
  double y = 0;
  if (x <= kMiddle) {
    y = (1 / library_pow(kMiddle, kPower - 1)) * library_pow(x, kPower);
  } else {
    y = 1 - (1 / library_pow(1 - kMiddle, kPower - 1)) * library_pow(1 - x, kPower);
  }
  return kSolimp[0] + y * (kSolimp[1] - kSolimp[0]);
}

/// getimpedance.
template <typename Of, int W>
WALKER_SIM_INLINE inline Vector<W> impedance(Vector<W> distance, Mask<W> wanted) {
  using V = Vector<W>;
  constexpr const double* kSolimp = Of::kSolimp;
  if constexpr (kSolimp[0] == kSolimp[1]) return 0.5 * (kSolimp[0] + kSolimp[1]);
  const V x = abs(distance / V(kSolimp[2]));
  V result = kSolimp[1];
  for (unsigned lanes = to_bits(wanted & (x < V(1.0))); lanes != 0; lanes &= lanes - 1) {
    const int lane = __builtin_ctz(lanes);
    result.set(lane, x[lane] > 0 ? impedance_within<Of>(x[lane]) : kSolimp[0]);
  }
  return result;
}

/// mj_instantiateLimit.
template <int W>
WALKER_SIM_INLINE inline void find_limits(const ModelValues<Vector<W>>& values,
                                          const Vector<W>* qpos, const Vector<W>* qvel,
                                          Rows<W>& rows) {
  using V = Vector<W>;
  const V zero = 0.0;
  unrolled<kLimits>([&](auto i) WALKER_SIM_INLINE {
    constexpr int joint = kFirstLimited + i;
    const V above_low = V(-1.0) * (V(model::jnt_range[joint][0]) - qpos[joint]);
    const V below_high = V(model::jnt_range[joint][1]) - qpos[joint];
    const Mask<W> is_low = above_low < zero;
    const Mask<W> is_beyond = is_low | (below_high < zero);
    if (!any(is_beyond)) return;
    auto& limit = rows.limits[rows.num_limits++];
    const V distance = select(is_low, above_low, below_high);
    const V share = impedance<Limits>(distance, is_beyond);
    const V R = (V(1.0) - share) * values.limit_weight[i] / share;
    limit.dof = joint;
    limit.lanes = to_bits(is_beyond);
    limit.D = V(1.0) / select(R < V(kMinimum), V(kMinimum), R);
    limit.jacobian = select(is_low, V(1.0), select(is_beyond, V(-1.0), zero));
    const V speed = limit.jacobian * qvel[joint];
    limit.reference = select(
        is_beyond, -V(kDamping<Limits>) * speed - V(kStiffness<Limits>) * share * distance, zero);
    rows.has_any = rows.has_any | is_beyond;
  });
}

/// mj_instantiateContact, mj_makeImpedance, mj_referenceConstraint.
template <int Side, int W>
WALKER_SIM_INLINE inline void make_slot(const Smooth<Vector<W>>& smooth, const Touch<W>& touch,
                                        const Vector<W>* qvel, typename Rows<W>::Slot& slot,
                                        Mask<W>& has_any) {
  using V = Vector<W>;
  const V zero = 0.0;
  const Mask<W> is_there = V(0.5) < touch.moves[0];
  has_any = has_any | is_there;
  const V x = touch.x - smooth.com_x;
  const V z = touch.z - smooth.com_z;
  unrolled<model::nv>([&](auto dof) WALKER_SIM_INLINE {
    if constexpr (has_column(Side, dof)) {
      V along_x = model::jnt_axis[dof][0];
      V along_z = model::jnt_axis[dof][2];
      if constexpr (is_hinge(dof)) {
        along_x = smooth.cdof_x[dof] + V(model::jnt_axis[dof][1]) * z;
        along_z = smooth.cdof_z[dof] - V(model::jnt_axis[dof][1]) * x;
      }
      const V normal = along_x * touch.normal_x + along_z * touch.normal_z;
      const V tangent = along_x * touch.tangent_x + along_z * touch.tangent_z;
      const Mask<W> moves = V(0.5) < touch.moves[dof];
      slot.jacobian[0][dof] = select(moves, normal + tangent * touch.friction, zero);
      slot.jacobian[1][dof] = select(moves, normal + tangent * -touch.friction, zero);
      slot.jacobian[2][dof] = select(moves, normal, zero);
    }
  });
  const V violation = touch.distance - V(Contacts::kMargin);
  const V share = impedance<Contacts>(violation, is_there);
  V R = (V(1.0) - share) * touch.diagonal / share;
  R = select(R < V(kMinimum), V(kMinimum), R);
  slot.D = V(1.0) / (V(2.0) * touch.friction * touch.friction * R);
  const V spring = V(kStiffness<Contacts>) * share * violation;
  unrolled<kRows>([&](auto row) WALKER_SIM_INLINE {
    const V speed = row_times<Side, row>(slot.jacobian, qvel);
    slot.reference[row] = select(is_there, -V(kDamping<Contacts>) * speed - spring, zero);
  });
}

/// @param lines of the lanes' grounds; null: no lane has a level
/// @return lanes with more contacts than slots
template <int W>
__attribute__((noinline)) Mask<W> make_rows(const Smooth<Vector<W>>& smooth,
                                            const ModelValues<Vector<W>>& values,
                                            const GroundLine* const* lines, const Vector<W>* qpos,
                                            const Vector<W>* qvel, Rows<W>& rows) {
  rows.num_limits = 0;
  rows.has_any = Mask<W>::none();
  find_limits(values, qpos, qvel, rows);
  Touches<W> touches;
  Mask<W> has_too_many = Mask<W>::none();
  if (lines == nullptr) {
    touch_floor(smooth, values, touches);
  } else {
    has_too_many = touch_lines(smooth, values, lines, touches);
  }
  static_cast<TouchCounts&>(rows) = touches;
  const Touch<W>* touch = touches.slots;
  rows.for_each_slot([&](auto side, typename Rows<W>::Slot& slot) WALKER_SIM_INLINE {
    make_slot<side>(smooth, *touch++, qvel, slot, rows.has_any);
  });
  return has_too_many;
}

/// Returns a key of a lane's contacts and limits. Lanes with equal keys are fastest together.
template <int W>
inline unsigned pattern(const Rows<W>& rows, int lane) {
  constexpr int kCountShift = kLimits + kEnds;
  unsigned contacts = 0;
  unsigned ends = 0;
  unsigned limits = 0;
  for (int end = 0; end < kEnds; ++end) {
    const unsigned touches = rows.touching[end] >> lane & 1U;
    contacts += touches;
    ends |= touches << end;
  }
  for (int k = 0; k < rows.num_limits; ++k) {
    limits |= (rows.limits[k].lanes >> lane & 1U) << (rows.limits[k].dof - kFirstLimited);
  }
  return contacts << kCountShift | ends << kLimits | limits;
}

}  // namespace WALKER_SIM_INSTRUCTION_SET
}  // namespace walker::mujoco::kernel::WALKER_SIM_ROBOT
