// Whether a robot's limbs may touch each other. The kernel has no rows for such contacts: the
// library makes these steps.
//
// Capsules touch if the distance of their axes is below r1 + r2 + margin. In the plane, the
// distance is 0 if the segments cross, else the smallest from an end of one segment to the other
// segment:
//
//   end e, segment from p along s:   t = clamp((e - p).s / |s|^2, 0, 1),   |e - (p + t s)|
//   crossing: the ends of each segment are on different sides of the other's line
//
// First, pairs whose bounding spheres are apart are excluded. 1 mm is added to the margin for
// rounding. Inputs: the capsules' ends (smooth.h).
#pragma once

#include "robots/mujoco/kernel/smooth.h"

namespace walker::mujoco::kernel::WALKER_SIM_ROBOT {
inline namespace WALKER_SIM_INSTRUCTION_SET {

/// The axis of a limb's capsule.
template <typename V>
struct Segment {
  V x, z;              ///< one end
  V along_x, along_z;  ///< to the other end
  double inverse_square_length;
};

template <int Limb, typename V>
WALKER_SIM_INLINE inline Segment<V> axis_of(const Smooth<V>& smooth) {
  constexpr double length = 2 * model::geom_size[Limb + 1][1];
  const V x = smooth.end_x[2 * Limb];
  const V z = smooth.end_z[2 * Limb];
  return {x, z, smooth.end_x[2 * Limb + 1] - x, smooth.end_z[2 * Limb + 1] - z,
          1 / (length * length)};
}

/// Twice the signed area of the triangle of the segment and a point.
template <typename V>
WALKER_SIM_INLINE inline V area(const Segment<V>& segment, V x, V z) {
  return segment.along_x * (z - segment.z) - segment.along_z * (x - segment.x);
}

template <typename V>
WALKER_SIM_INLINE inline V square_distance(const Segment<V>& segment, V x, V z) {
  const V to_x = x - segment.x;
  const V to_z = z - segment.z;
  V part = (to_x * segment.along_x + to_z * segment.along_z) * V(segment.inverse_square_length);
  part = select(part < V(0.0), V(0.0), select(part > V(1.0), V(1.0), part));
  const V off_x = to_x - part * segment.along_x;
  const V off_z = to_z - part * segment.along_z;
  return off_x * off_x + off_z * off_z;
}

/// Whether two segments cross or are nearer to each other than a distance.
template <typename V>
WALKER_SIM_INLINE inline auto are_near(const Segment<V>& a, const Segment<V>& b, double distance) {
  const V zero = 0.0;
  const V square = distance * distance;
  const V a_x = a.x + a.along_x;
  const V a_z = a.z + a.along_z;
  const V b_x = b.x + b.along_x;
  const V b_z = b.z + b.along_z;
  const auto cross = (area(a, b.x, b.z) * area(a, b_x, b_z) < zero) &
                     (area(b, a.x, a.z) * area(b, a_x, a_z) < zero);
  return cross | (square_distance(a, b.x, b.z) < square) | (square_distance(a, b_x, b_z) < square) |
         (square_distance(b, a.x, a.z) < square) | (square_distance(b, a_x, a_z) < square);
}

/// Returns the lanes in which limbs may touch each other, as in some pairs of the model. They
/// include every lane in which MuJoCo finds such a contact: coordinates up to kMaxValue round to
/// less than kRounding.
template <int W>
__attribute__((noinline)) Mask<W> find_limbs_that_meet(const Smooth<Vector<W>>& smooth) {
  using V = Vector<W>;
  constexpr double kRounding = 1e-3;  // [m]
  Mask<W> meet = Mask<W>::none();
  unrolled<model::npair - kLimbs>([&](auto p) WALKER_SIM_INLINE {
    constexpr int pair = kLimbs + p;
    constexpr int one = model::pair_geom1[pair];
    constexpr int other = model::pair_geom2[pair];
    constexpr double margin = model::pair_margin[pair] + kRounding;
    constexpr double reach = model::geom_rbound[one] + model::geom_rbound[other] + margin;
    const Segment<V> a = axis_of<one - 1>(smooth);
    const Segment<V> b = axis_of<other - 1>(smooth);
    const V x = (a.x - b.x) + (a.along_x - b.along_x) * V(0.5);
    const V z = (a.z - b.z) + (a.along_z - b.along_z) * V(0.5);
    if (!any(x * x + z * z < V(reach * reach))) return;
    meet = meet | are_near(a, b, model::geom_size[one][0] + model::geom_size[other][0] + margin);
  });
  return meet;
}

}  // namespace WALKER_SIM_INSTRUCTION_SET
}  // namespace walker::mujoco::kernel::WALKER_SIM_ROBOT
