// b2ContactSolver's position corrections for contacts between one body of the walker and the static
// terrain.
//
// Restates formulas of Box2D 2.3, Copyright (c) 2006-2011 Erin Catto http://www.box2d.org, in code
// of our own, which is not the original software. lanes.h has the terms.
#pragma once

#include "robots/bipedal_walker/kernel/contact.h"
#include "robots/bipedal_walker/kernel/revolute_joint.h"
#include "robots/bipedal_walker/kernel/rotation.h"

namespace walker::bipedal_walker::kernel {
inline namespace WALKER_SIM_INSTRUCTION_SET {

constexpr float kMaxLinearCorrection = 0.2F;  ///< b2_maxLinearCorrection [m]

/// b2ContactSolver::SolvePositionConstraints and SolveTOIPositionConstraints for one contact.
/// @param share      fraction of the error to correct: b2_baumgarte or b2_toiBaugarte
/// @param separation receives the minimum of its value and this contact's separation
template <int W>
WALKER_SIM_INLINE inline void solve_position(const ManifoldLanes<W>& manifold, bool any_two,
                                             const MassLanes<W>& model, float share,
                                             PlaceLanes<W>& body, Number<W>& separation) {
  const Number<W> zero(0);
  const Number<W> mass = model.inverse_mass;
  const Number<W> inertia = model.inverse_inertia;
  const Rotation<Number<W>> upright{zero, Number<W>(1)};
  const Vec2<W> origin{zero, zero};
  const Vec2<W> local_normal{manifold.normal_x, manifold.normal_y};
  const Vec2<W> plane{manifold.plane_x, manifold.plane_y};
  const Truth<W> face_is_b = manifold.walker_has_face ^ manifold.walker_is_a;
  const Number<W> sign = select(manifold.walker_is_a, Number<W>(-1), Number<W>(1));
  const Number<W> signed_mass = sign * mass;
  const Number<W> signed_inertia = sign * inertia;

  for (int i = 0; i < (any_two ? 2 : 1); ++i) {
    const Truth<W> takes_part =
        i == 0 ? manifold.exists : manifold.exists & manifold.has_two_points;
    const Rotation<Number<W>> rotation = rotation_of<W>(body.angle);
    const Transform<W> walker{rotation, body.center - rotate(rotation, model.center)};
    const Transform<W> terrain{upright, origin};
    const Vec2<W> point{manifold.point_x[i], manifold.point_y[i]};

    // b2PositionSolverManifold::Initialize.
    const Vec2<W> face_normal = select(manifold.walker_has_face, rotate(rotation, local_normal),
                                       rotate(upright, local_normal));
    const Vec2<W> plane_point =
        select(manifold.walker_has_face, transform(walker, plane), transform(terrain, plane));
    const Vec2<W> clip_point =
        select(manifold.walker_has_face, transform(terrain, point), transform(walker, point));
    const Number<W> radius(kPolygonRadius);
    const Number<W> distance = dot(clip_point - plane_point, face_normal) - radius - radius;
    const Vec2<W> normal = select(face_is_b, -face_normal, face_normal);

    const Vec2<W> arm = clip_point - body.center;
    const Number<W> error = clamp(Number<W>(share) * (distance + Number<W>(kLinearSlop)),
                                  Number<W>(-kMaxLinearCorrection), zero);
    const Number<W> arm_along = cross(arm, normal);
    const Number<W> mass_along = mass + inertia * arm_along * arm_along;
    const Number<W> push = -error / mass_along;
    const Vec2<W> impulse = push * normal;

    separation = select(takes_part, min(separation, distance), separation);
    body.center = select(takes_part, body.center + signed_mass * impulse, body.center);
    body.angle = select(takes_part, body.angle + signed_inertia * cross(arm, impulse), body.angle);
  }
}

}  // namespace WALKER_SIM_INSTRUCTION_SET
}  // namespace walker::bipedal_walker::kernel
