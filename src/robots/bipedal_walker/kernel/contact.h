// b2ContactSolver's constraints for contacts between one body of the walker and the static
// ground, which is at the origin.
//
// A contact has a body A and a body B, and its normal n points from A to B. One of them is the
// walker's; the other is the ground's, with zero inverse mass and zero velocity. So of
//
//   dv = vB + wB x rB - vA - wA x rA
//   vA -= mA P,  wA -= iA rA x P,    vB += mB P,  wB += iB rB x P
//
// only the walker's half remains, with the sign s = 1 if the walker is B and -1 if it is A:
//
//   dv = s (v + w x r),    v += s m P,  w += s i r x P
//
// Here v [m/s] and w [rad/s] are the body's velocities, m and i its inverse mass and inertia, r the
// arm from its centre of mass to the point, and P the impulse [N s]. Iterations clamp the
// accumulated impulses of a point, not their changes: from a_t and a_n along tangent t and normal n
// they compute x_t and x_n, in this order, and apply P = (x - a) times the axis. The friction
// coefficient is mu:
//
//   m_t = 1 / (m + i (r x t)^2),   x_t = clamp(a_t - m_t dv.t, -mu a_n, mu a_n)
//   m_n = 1 / (m + i (r x n)^2),   x_n = max(a_n - m_n dv.n, 0)
//
// Two points of a manifold have a joint solution x_n (`solve_two_normals`), with the matrix
// K_jk = m + i (r_j x n) (r_k x n), unless it is ill-conditioned: k11^2 >= 1000 det K.
//
// In position iterations, c is the centre of mass, a the angle, the separation d the distance of
// the surfaces along n, and beta = 0.2, or 0.75 at a time of impact. Each point in turn:
//
//   C = clamp(beta (d + b2_linearSlop), -b2_maxLinearCorrection, 0)
//   P = -C / (m + i (r x n)^2) n,   c += s m P,   a += s i r x P
//
// There is no restitution, so the normal velocity's target is 0.
//
// The ground's terms in Box2D are zero, but adding a signed zero may change the sign of another
// zero: `zero_before` and `zero_after` below are these terms.
//
// Inputs: the manifolds. State: the accumulated impulses.
//
// Source: Box2D (box2d-py 2.3.8), Dynamics/Contacts/b2ContactSolver.cpp,
// InitializeVelocityConstraints, WarmStart, SolveVelocityConstraints, SolvePositionConstraints,
// SolveTOIPositionConstraints; Collision/b2Collision.cpp, b2WorldManifold::Initialize.
//
// Restates formulas of Box2D 2.3, Copyright (c) 2006-2011 Erin Catto http://www.box2d.org, in code
// of our own, which is not the original software. lanes.h has the terms.
#pragma once

#include "robots/bipedal_walker/kernel/lanes.h"

namespace walker::bipedal_walker::kernel {
inline namespace WALKER_SIM_INSTRUCTION_SET {

constexpr float kPolygonRadius = 2 * kLinearSlop;  ///< b2_polygonRadius [m]
constexpr float kMaxLinearCorrection = 0.2F;       ///< b2_maxLinearCorrection [m]

/// Upper bound of the slots, each of which belongs to one body.
constexpr int kMaxContactsInLanes = kBodies * kMaxContactsOfBody;

template <int W>
using ManifoldLanes = ContactManifold<Number<W>, Truth<W>>;

/// b2VelocityConstraintPoint.
template <int W>
struct PointLanes {
  Vec2<W> arm;         ///< from the walker's centre to the point: rB, or rA
  Vec2<W> zero_after;  ///< 0 x rA if the ground is A, else 0
  Number<W> normal_mass, tangent_mass;
  Number<W> normal_impulse, tangent_impulse;
};

/// b2ContactVelocityConstraint.
template <int W>
struct ContactLanes {
  Vec2<W> normal;
  Number<W> friction;
  PointLanes<W> points[2];
  Mat22<W> k, inverse_k;
  Truth<W> exists, has_two;
  Number<W> sign, zero_before;
  Number<W> signed_mass, signed_inertia;
  bool any_one, any_two, all_exist, any_walker_is_a;
};

/// Returns the normal of the reference face in world coordinates.
template <int W>
WALKER_SIM_INLINE inline Vec2<W> face_normal_of(const ManifoldLanes<W>& manifold,
                                                const Transform<W>& walker) {
  const Rotation<Number<W>> upright{Number<W>(0), Number<W>(1)};
  const Vec2<W> normal{manifold.normal_x, manifold.normal_y};
  return select(manifold.walker_has_face, rotate(walker.rotation, normal), rotate(upright, normal));
}

/// A manifold's point in world coordinates.
template <int W>
struct WorldPoint {
  Vec2<W> plane_point;  ///< on the reference face
  Vec2<W> clip_point;   ///< on the other body
};

/// The common part of b2WorldManifold::Initialize and b2PositionSolverManifold::Initialize.
template <int W>
WALKER_SIM_INLINE inline WorldPoint<W> world_point(const ManifoldLanes<W>& manifold, int index,
                                                   const Transform<W>& walker) {
  const Transform<W> ground{{Number<W>(0), Number<W>(1)}, {Number<W>(0), Number<W>(0)}};
  const Vec2<W> plane{manifold.plane_x, manifold.plane_y};
  const Vec2<W> point{manifold.point_x[index], manifold.point_y[index]};
  return {select(manifold.walker_has_face, transform(walker, plane), transform(ground, plane)),
          select(manifold.walker_has_face, transform(ground, point), transform(walker, point))};
}

/// b2ContactSolver::InitializeVelocityConstraints. The caller sets the impulses.
///
/// A point is halfway between the two surfaces: with the clip point p of the other body, the face's
/// plane point q and normal f, and the radius of both polygons,
///
///   point = 1/2 ((p + (radius - (p - q).f) f) + (p - radius f)),   arm = point - center
/// @param center centre of mass of the walker's body
template <int W>
WALKER_SIM_INLINE inline void prepare(const ManifoldLanes<W>& manifold, const MassLanes<W>& body,
                                      Vec2<W> center, const Transform<W>& walker,
                                      ContactLanes<W>& contact) {
  const Number<W> zero(0);
  const Number<W> one(1);
  const Number<W> radius(kPolygonRadius);
  const Number<W> mass = body.inverse_mass;
  const Number<W> inertia = body.inverse_inertia;
  const Truth<W> is_a = manifold.walker_is_a;

  const Vec2<W> face_normal = face_normal_of(manifold, walker);
  const Truth<W> face_is_b = manifold.walker_has_face ^ is_a;
  const Vec2<W> normal = select(face_is_b, -face_normal, face_normal);
  const Vec2<W> tangent = tangent_of(normal);

  const auto mass_along = [&](Vec2<W> arm_1, Vec2<W> arm_2, Vec2<W> axis) WALKER_SIM_INLINE {
    return mass + inertia * cross(arm_1, axis) * cross(arm_2, axis);
  };
  for (int i = 0; i < 2; ++i) {
    PointLanes<W>& point = contact.points[i];
    const auto [plane_point, clip_point] = world_point(manifold, i, walker);
    const Vec2<W> on_face =
        clip_point + (radius - dot(clip_point - plane_point, face_normal)) * face_normal;
    const Vec2<W> on_other = clip_point - radius * face_normal;
    const Vec2<W> middle = Number<W>(0.5F) * (on_face + on_other);
    point.arm = middle - center;
    point.zero_after = select(is_a, Vec2<W>{zero, zero}, cross(zero, middle));
    point.normal_mass = one / mass_along(point.arm, point.arm, normal);
    point.tangent_mass = one / mass_along(point.arm, point.arm, tangent);
  }

  // The block solver's matrix. If it is nearly singular, only the first point is solved.
  const Vec2<W> arm_1 = contact.points[0].arm;
  const Vec2<W> arm_2 = contact.points[1].arm;
  const Number<W> k11 = mass_along(arm_1, arm_1, normal);
  const Number<W> k22 = mass_along(arm_2, arm_2, normal);
  const Number<W> k12 = mass_along(arm_1, arm_2, normal);
  const Number<W> max_condition(1000);  // k_maxConditionNumber
  const Number<W> determinant = k11 * k22 - k12 * k12;
  contact.has_two =
      manifold.has_two_points & manifold.exists & (k11 * k11 < max_condition * determinant);
  contact.k = {{k11, k12}, {k12, k22}};
  const Number<W> inverse = inverse_of(determinant);
  contact.inverse_k = {{inverse * k22, -inverse * k12}, {-inverse * k12, inverse * k11}};

  contact.normal = normal;
  contact.friction = manifold.friction;
  contact.exists = manifold.exists;
  contact.sign = select(is_a, -one, one);
  contact.zero_before = select(is_a, zero, -zero);
  contact.signed_mass = contact.sign * mass;
  contact.signed_inertia = contact.sign * inertia;
  contact.any_two = any(contact.has_two);
  contact.any_one = any(manifold.exists & ~contact.has_two);
  contact.all_exist = !any(~manifold.exists);
  contact.any_walker_is_a = any(is_a);
}

/// Applies an impulse P to the walker's body: v += s m P, w += s i r x P.
template <int W>
WALKER_SIM_INLINE inline void apply(const ContactLanes<W>& contact, Vec2<W> impulse,
                                    Number<W> angular_impulse, BodyLanes<W>& body) {
  body.velocity = body.velocity + contact.signed_mass * impulse;
  body.angular_velocity += contact.signed_inertia * angular_impulse;
}

/// b2ContactSolver::WarmStart.
template <int W>
WALKER_SIM_INLINE inline void warm_start(const ContactLanes<W>& contact, BodyLanes<W>& body) {
  const Vec2<W> tangent = tangent_of(contact.normal);
  for (int i = 0; i < 2; ++i) {
    const PointLanes<W>& point = contact.points[i];
    const Vec2<W> impulse = point.normal_impulse * contact.normal + point.tangent_impulse * tangent;
    BodyLanes<W> after = body;
    apply(contact, impulse, cross(point.arm, impulse), after);
    body = select(i == 0 ? contact.exists : contact.has_two, after, body);
  }
}

/// Returns dv, the velocity of B at the point relative to A.
template <int W>
WALKER_SIM_INLINE inline Vec2<W> relative_velocity(const ContactLanes<W>& contact,
                                                   const PointLanes<W>& point,
                                                   const BodyLanes<W>& body) {
  const Vec2<W> turning = cross(body.angular_velocity, point.arm);
  if (contact.any_walker_is_a) {
    const Vec2<W> zero{contact.zero_before, contact.zero_before};
    return ((zero + contact.sign * body.velocity) + contact.sign * turning) - point.zero_after;
  }
  return (body.velocity + turning) - point.zero_after;
}

template <int W>
WALKER_SIM_INLINE inline void solve_tangent(const ContactLanes<W>& contact, PointLanes<W>& point,
                                            BodyLanes<W>& body) {
  const Vec2<W> tangent = tangent_of(contact.normal);
  const Number<W> speed = dot(relative_velocity(contact, point, body), tangent);
  const Number<W> wanted = point.tangent_mass * -speed;
  const Number<W> max_friction = contact.friction * point.normal_impulse;
  const Number<W> accumulated = clamp(point.tangent_impulse + wanted, -max_friction, max_friction);
  const Vec2<W> impulse = (accumulated - point.tangent_impulse) * tangent;
  point.tangent_impulse = accumulated;
  apply(contact, impulse, cross(point.arm, impulse), body);
}

/// @return the point's new normal impulse
template <int W>
WALKER_SIM_INLINE inline Number<W> solve_normal(const ContactLanes<W>& contact,
                                                const PointLanes<W>& point, BodyLanes<W>& body) {
  const Number<W> speed = dot(relative_velocity(contact, point, body), contact.normal);
  const Number<W> wanted = -point.normal_mass * speed;
  const Number<W> accumulated = max(point.normal_impulse + wanted, Number<W>(0));
  const Vec2<W> impulse = (accumulated - point.normal_impulse) * contact.normal;
  apply(contact, impulse, cross(point.arm, impulse), body);
  return accumulated;
}

/// Block solver. Each point either pushes or separates; the first of the four cases that satisfies
///
///   vn = K x + b',    b' = vn(now) - K a,    vn >= 0,  x >= 0,  vn_i x_i = 0
///
/// gives the new impulses x, where a are the present ones. If no case does, nothing changes.
/// @return the points' new normal impulses
template <int W>
WALKER_SIM_INLINE inline Vec2<W> solve_two_normals(const ContactLanes<W>& contact,
                                                   BodyLanes<W>& body) {
  const PointLanes<W>& point_1 = contact.points[0];
  const PointLanes<W>& point_2 = contact.points[1];
  const Mat22<W>& k = contact.k;
  const Mat22<W>& inverse_k = contact.inverse_k;
  const Number<W> zero(0);
  const Vec2<W> a{point_1.normal_impulse, point_2.normal_impulse};
  const Vec2<W> b{dot(relative_velocity(contact, point_1, body), contact.normal) -
                      (k.ex.x * a.x + k.ey.x * a.y),
                  dot(relative_velocity(contact, point_2, body), contact.normal) -
                      (k.ex.y * a.x + k.ey.y * a.y)};
  const Vec2<W> both{-(inverse_k.ex.x * b.x + inverse_k.ey.x * b.y),
                     -(inverse_k.ex.y * b.x + inverse_k.ey.y * b.y)};
  const Number<W> first = -point_1.normal_mass * b.x;
  const Number<W> second = -point_2.normal_mass * b.y;
  const Truth<W> both_push = (both.x >= zero) & (both.y >= zero);
  const Truth<W> first_pushes = (first >= zero) & (k.ex.y * first + b.y >= zero);
  const Truth<W> second_pushes = (second >= zero) & (k.ey.x * second + b.x >= zero);
  const Truth<W> none_pushes = (b.x >= zero) & (b.y >= zero);
  const Vec2<W> x{
      select(both_push, both.x, select(first_pushes, first, zero)),
      select(both_push, both.y, select(first_pushes, zero, select(second_pushes, second, zero)))};
  const Truth<W> is_solved = both_push | first_pushes | second_pushes | none_pushes;

  const Vec2<W> difference = x - a;
  const Vec2<W> impulse_1 = difference.x * contact.normal;
  const Vec2<W> impulse_2 = difference.y * contact.normal;
  BodyLanes<W> after = body;
  apply(contact, impulse_1 + impulse_2,
        cross(point_1.arm, impulse_1) + cross(point_2.arm, impulse_2), after);
  body = select(is_solved, after, body);
  return select(is_solved, x, a);
}

/// b2ContactSolver::SolveVelocityConstraints for one contact.
template <int W>
WALKER_SIM_INLINE inline void solve(ContactLanes<W>& contact, BodyLanes<W>& body) {
  PointLanes<W>& point_1 = contact.points[0];
  PointLanes<W>& point_2 = contact.points[1];
  BodyLanes<W> now = body;
  solve_tangent(contact, point_1, now);
  if (!contact.any_two) {
    point_1.normal_impulse = solve_normal(contact, point_1, now);
  } else if (!contact.any_one) {
    solve_tangent(contact, point_2, now);
    const Vec2<W> impulses = solve_two_normals(contact, now);
    point_1.normal_impulse = impulses.x;
    point_2.normal_impulse = impulses.y;
  } else {
    BodyLanes<W> with_one = now;
    const Number<W> impulse_of_one = solve_normal(contact, point_1, with_one);
    solve_tangent(contact, point_2, now);
    const Vec2<W> impulses = solve_two_normals(contact, now);
    point_1.normal_impulse = select(contact.has_two, impulses.x, impulse_of_one);
    point_2.normal_impulse = impulses.y;
    now = select(contact.has_two, now, with_one);
  }
  body = contact.all_exist ? now : select(contact.exists, now, body);
}

/// b2ContactSolver::SolvePositionConstraints and SolveTOIPositionConstraints for one contact.
/// @param share      fraction of the error to correct: b2_baumgarte or b2_toiBaugarte
/// @param separation receives the minimum of its value and this contact's separation
template <int W>
WALKER_SIM_INLINE inline void solve_position(const ManifoldLanes<W>& manifold, bool any_two,
                                             const MassLanes<W>& model, float share,
                                             PositionLanes<W>& body, Number<W>& separation) {
  const Number<W> inertia = model.inverse_inertia;
  const Truth<W> face_is_b = manifold.walker_has_face ^ manifold.walker_is_a;
  const Number<W> sign = select(manifold.walker_is_a, Number<W>(-1), Number<W>(1));
  const Number<W> signed_mass = sign * model.inverse_mass;
  const Number<W> signed_inertia = sign * inertia;
  const Number<W> radius(kPolygonRadius);

  for (int i = 0; i < (any_two ? 2 : 1); ++i) {
    const Truth<W> takes_part =
        i == 0 ? manifold.exists : manifold.exists & manifold.has_two_points;
    const Rotation<Number<W>> rotation = rotation_of<W>(body.angle);
    const Transform<W> walker{rotation, body.center - rotate(rotation, model.center)};
    const Vec2<W> face_normal = face_normal_of(manifold, walker);
    const auto [plane_point, clip_point] = world_point(manifold, i, walker);
    const Number<W> distance = dot(clip_point - plane_point, face_normal) - radius - radius;
    const Vec2<W> normal = select(face_is_b, -face_normal, face_normal);

    const Vec2<W> arm = clip_point - body.center;
    const Number<W> error = clamp(Number<W>(share) * (distance + Number<W>(kLinearSlop)),
                                  Number<W>(-kMaxLinearCorrection), Number<W>(0));
    const Number<W> arm_along = cross(arm, normal);
    const Number<W> mass_along = model.inverse_mass + inertia * arm_along * arm_along;
    const Vec2<W> impulse = (-error / mass_along) * normal;

    separation = select(takes_part, min(separation, distance), separation);
    body.center = select(takes_part, body.center + signed_mass * impulse, body.center);
    body.angle = select(takes_part, body.angle + signed_inertia * cross(arm, impulse), body.angle);
  }
}

}  // namespace WALKER_SIM_INSTRUCTION_SET
}  // namespace walker::bipedal_walker::kernel
