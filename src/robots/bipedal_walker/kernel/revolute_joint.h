// b2RevoluteJoint with a motor and limits, as all of the walker's joints have. Each iteration
// solves the motor, then the point and, if the joint is at a limit, the angle:
//
//   motor   C = wB - wA - speed                             impulse: torque
//   point   C = vB + wB x rB - vA - wA x rA                 impulse: P
//   limit   C = wB - wA, never pushing beyond the limit     impulse: z
//
// Here v [m/s] and w [rad/s] are velocities, m and i inverse masses and inertias, and r the arms
// from the centres of mass to the anchor [m]. An impulse changes the velocities by
//
//   vA -= mA P,   wA -= iA (rA x P + z),   vB += mB P,   wB += iB (rB x P + z)
//
// The motor's impulse is a z alone. (C_point, C_limit) changes by K (P, z) with the symmetric K:
//
//   exx = mA + mB + iA rAy^2 + iB rBy^2     exy = -iA rAx rAy - iB rBx rBy
//   eyy = mA + mB + iA rAx^2 + iB rBx^2     exz = -iA rAy - iB rBy
//   ezz = iA + iB                           eyz = iA rAx + iB rBx
//
// With K22, its part of the point, and the accumulated impulses a_m of the motor and a_z of the
// limit, an iteration computes
//
//   motor         x = clamp(a_m - C / (iA + iB), -dt max_torque, dt max_torque),  impulse x - a_m
//   no limit      P = -K22^-1 C_point
//   at a limit    (P, z) = -K^-1 (C_point, C_limit); if a_z + z < 0 at the lower limit, or > 0 at
//                 the upper one: z = -a_z,  P = -K22^-1 (C_point - a_z (exz, eyz))
//
// Position iterations, with the angle q = aB - aA - reference_angle and the centres c:
//
//   limit   C = clamp(q - lower + b2_angularSlop, -8 degrees, 0), at the upper limit
//           clamp(q - upper - b2_angularSlop, 0, 8 degrees);   z = -C / (iA + iB)
//   point   C = cB + rB - cA - rA,   P = -K22^-1 C             whole error, no Baumgarte factor
//
// and apply P and z to c and a as above to v and w. Inputs: motor speed and torque limit. State:
// accumulated impulses, and which limit the joint was at: at another one, a_z starts from 0.
//
// Source: Box2D (box2d-py 2.3.8), Dynamics/Joints/b2RevoluteJoint.cpp, InitVelocityConstraints,
// SolveVelocityConstraints, SolvePositionConstraints.
//
// Restates formulas of Box2D 2.3, Copyright (c) 2006-2011 Erin Catto http://www.box2d.org, in code
// of our own, which is not the original software. lanes.h has the terms.
#pragma once

#include "robots/bipedal_walker/kernel/lanes.h"

namespace walker::bipedal_walker::kernel {
inline namespace WALKER_SIM_INSTRUCTION_SET {

/// Bodies A and B of a joint. The hull is in the middle of the chain, and A is on the hull's side.
constexpr int body_a(int joint) { return joint < kJoints / 2 ? joint + 1 : joint; }
constexpr int body_b(int joint) { return joint < kJoints / 2 ? joint : joint + 1; }

/// Data of a joint for velocity iterations.
template <int W>
struct JointLanes {
  Vec2<W> arm_a, arm_b;
  Number<W> motor_mass, motor_speed, max_motor_impulse;
  Number<W> motor_impulse, limit_impulse;
  Vec2<W> impulse;
  Number<W> exx, exy, exz, eyy, eyz, ezz;           ///< m_mass, symmetric: ez.x = ex.z, ...
  Number<W> inverse_determinant;                    ///< upper left 2 x 2 block
  Number<W> inverse_determinant_3;                  ///< 3 x 3 matrix
  Number<W> eyz_cross_x, eyz_cross_y, eyz_cross_z;  ///< b2Cross(ey, ez)
  Truth<W> at_lower, at_upper, at_limit;
  bool any_at_limit;
};

/// b2RevoluteJoint::InitVelocityConstraints, with its warm start.
template <int W>
WALKER_SIM_INLINE inline void prepare(
    const Model::Joint& model, const InverseMass<Number<W>>& inverse_a,
    const InverseMass<Number<W>>& inverse_b, float dt, float dt_ratio,
    const JointState<Number<W>, Truth<W>>& state, const BodyState<Number<W>>& state_a,
    const BodyState<Number<W>>& state_b, const Rotation<Number<W>>& rotation_a,
    const Rotation<Number<W>>& rotation_b, JointLanes<W>& joint, BodyLanes<W>& a, BodyLanes<W>& b) {
  const auto [mass_a, inertia_a] = inverse_a;
  const auto [mass_b, inertia_b] = inverse_b;
  const Vec2<W> arm_a = rotate(rotation_a, Vec2<W>{model.arm_a_x, model.arm_a_y});
  const Vec2<W> arm_b = rotate(rotation_b, Vec2<W>{model.arm_b_x, model.arm_b_y});
  joint.arm_a = arm_a;
  joint.arm_b = arm_b;

  joint.exx = mass_a + mass_b + arm_a.y * arm_a.y * inertia_a + arm_b.y * arm_b.y * inertia_b;
  joint.exy = -arm_a.y * arm_a.x * inertia_a - arm_b.y * arm_b.x * inertia_b;
  joint.exz = -arm_a.y * inertia_a - arm_b.y * inertia_b;
  joint.eyy = mass_a + mass_b + arm_a.x * arm_a.x * inertia_a + arm_b.x * arm_b.x * inertia_b;
  joint.eyz = arm_a.x * inertia_a + arm_b.x * inertia_b;
  joint.ezz = inertia_a + inertia_b;
  joint.motor_mass = Number<W>(1) / (inertia_a + inertia_b);
  joint.inverse_determinant = inverse_of(joint.exx * joint.eyy - joint.exy * joint.exy);
  joint.eyz_cross_x = joint.eyy * joint.ezz - joint.eyz * joint.eyz;
  joint.eyz_cross_y = joint.eyz * joint.exz - joint.exy * joint.ezz;
  joint.eyz_cross_z = joint.exy * joint.eyz - joint.eyy * joint.exz;
  joint.inverse_determinant_3 =
      inverse_of(joint.exx * joint.eyz_cross_x + joint.exy * joint.eyz_cross_y +
                 joint.exz * joint.eyz_cross_z);

  const Number<W> angle = state_b.angle - state_a.angle - Number<W>(model.reference_angle);
  joint.at_lower = angle <= Number<W>(model.lower_angle);
  joint.at_upper = ~joint.at_lower & (angle >= Number<W>(model.upper_angle));
  joint.at_limit = joint.at_lower | joint.at_upper;
  joint.any_at_limit = any(joint.at_limit);
  const Truth<W> is_same_limit =
      (joint.at_lower & state.at_lower) | (joint.at_upper & state.at_upper);

  const Number<W> ratio(dt_ratio);
  joint.motor_speed = state.motor_speed;
  joint.max_motor_impulse = Number<W>(dt) * state.motor_torque;
  joint.motor_impulse = state.motor_impulse * ratio;
  joint.limit_impulse = select(is_same_limit, state.limit_impulse, Number<W>(0)) * ratio;
  joint.impulse = {state.impulse_x * ratio, state.impulse_y * ratio};

  const Vec2<W> impulse = joint.impulse;
  a.velocity = a.velocity - mass_a * impulse;
  a.angular_velocity -=
      inertia_a * (cross(arm_a, impulse) + joint.motor_impulse + joint.limit_impulse);
  b.velocity = b.velocity + mass_b * impulse;
  b.angular_velocity +=
      inertia_b * (cross(arm_b, impulse) + joint.motor_impulse + joint.limit_impulse);
}

/// b2Mat33::Solve22.
template <int W>
WALKER_SIM_INLINE inline Vec2<W> solve_22(const JointLanes<W>& joint, Vec2<W> right) {
  return {joint.inverse_determinant * (joint.eyy * right.x - joint.exy * right.y),
          joint.inverse_determinant * (joint.exx * right.y - joint.exy * right.x)};
}

/// b2RevoluteJoint::SolveVelocityConstraints.
template <int W>
WALKER_SIM_INLINE inline void solve(const InverseMass<Number<W>>& inverse_a,
                                    const InverseMass<Number<W>>& inverse_b, JointLanes<W>& joint,
                                    BodyLanes<W>& a, BodyLanes<W>& b) {
  const auto [mass_a, inertia_a] = inverse_a;
  const auto [mass_b, inertia_b] = inverse_b;

  const Number<W> error = b.angular_velocity - a.angular_velocity - joint.motor_speed;
  const Number<W> accumulated = clamp(joint.motor_impulse + -joint.motor_mass * error,
                                      -joint.max_motor_impulse, joint.max_motor_impulse);
  const Number<W> torque = accumulated - joint.motor_impulse;
  joint.motor_impulse = accumulated;
  a.angular_velocity -= inertia_a * torque;
  b.angular_velocity += inertia_b * torque;

  const Vec2<W> slip = ((b.velocity + cross(b.angular_velocity, joint.arm_b)) - a.velocity) -
                       cross(a.angular_velocity, joint.arm_a);
  Vec2<W> impulse = solve_22(joint, -slip);
  Number<W> angular_a;
  Number<W> angular_b;
  if (joint.any_at_limit) {
    const Number<W> bx = slip.x;
    const Number<W> by = slip.y;
    const Number<W> bz = b.angular_velocity - a.angular_velocity;
    const Number<W> d = joint.inverse_determinant_3;
    // b2Mat33::Solve33, negated.
    const Vec2<W> with_limit{
        -(d * (bx * joint.eyz_cross_x + by * joint.eyz_cross_y + bz * joint.eyz_cross_z)),
        -(d * (joint.exx * (by * joint.ezz - bz * joint.eyz) +
               joint.exy * (bz * joint.exz - bx * joint.ezz) +
               joint.exz * (bx * joint.eyz - by * joint.exz)))};
    const Number<W> limit = -(d * (joint.exx * (joint.eyy * bz - joint.eyz * by) +
                                   joint.exy * (joint.eyz * bx - joint.exy * bz) +
                                   joint.exz * (joint.exy * by - joint.eyy * bx)));
    const Number<W> zero(0);
    const Number<W> held = joint.limit_impulse + limit;
    const Truth<W> pulls = (joint.at_lower & (held < zero)) | (joint.at_upper & (held > zero));
    const Vec2<W> released =
        solve_22(joint, -slip + joint.limit_impulse * Vec2<W>{joint.exz, joint.eyz});
    impulse = select(joint.at_limit, select(pulls, released, with_limit), impulse);
    // Adding -0 preserves every number, including the sign of zero.
    const Number<W> angular =
        select(joint.at_limit, select(pulls, -joint.limit_impulse, limit), -zero);
    joint.limit_impulse = select(joint.at_limit, select(pulls, zero, held), joint.limit_impulse);
    angular_a = cross(joint.arm_a, impulse) + angular;
    angular_b = cross(joint.arm_b, impulse) + angular;
  } else {
    angular_a = cross(joint.arm_a, impulse);
    angular_b = cross(joint.arm_b, impulse);
  }
  joint.impulse = joint.impulse + impulse;
  a.velocity = a.velocity - mass_a * impulse;
  a.angular_velocity -= inertia_a * angular_a;
  b.velocity = b.velocity + mass_b * impulse;
  b.angular_velocity += inertia_b * angular_b;
}

constexpr float kPi = 3.14159265359F;                         ///< b2_pi
constexpr float kAngularSlop = 2.0F / 180.0F * kPi;           ///< b2_angularSlop [rad]
constexpr float kMaxAngularCorrection = 8.0F / 180.0F * kPi;  ///< b2_maxAngularCorrection [rad]

/// b2RevoluteJoint::SolvePositionConstraints.
/// @return the lanes in which the errors of point and limit are within tolerance
template <int W>
WALKER_SIM_INLINE inline Truth<W> solve_position(const Model::Joint& model,
                                                 const InverseMass<Number<W>>& inverse_a,
                                                 const InverseMass<Number<W>>& inverse_b,
                                                 const JointState<Number<W>, Truth<W>>& state,
                                                 PositionLanes<W>& a, PositionLanes<W>& b) {
  const Number<W> zero(0);
  const auto [mass_a, inertia_a] = inverse_a;
  const auto [mass_b, inertia_b] = inverse_b;

  Truth<W> is_near = zero <= zero;
  if (any(state.at_lower | state.at_upper)) {
    const Number<W> angle = b.angle - a.angle - Number<W>(model.reference_angle);
    const Number<W> beyond_lower = angle - Number<W>(model.lower_angle);
    const Number<W> beyond_upper = angle - Number<W>(model.upper_angle);
    const Number<W> max_correction(kMaxAngularCorrection);
    const Number<W> slop(kAngularSlop);
    const Number<W> correction =
        select(state.at_lower, clamp(beyond_lower + slop, -max_correction, zero),
               clamp(beyond_upper - slop, zero, max_correction));
    const Number<W> motor_mass = Number<W>(1) / (inertia_a + inertia_b);
    const Number<W> impulse = -motor_mass * correction;
    const Truth<W> at_limit = state.at_lower | state.at_upper;
    a.angle = select(at_limit, a.angle - inertia_a * impulse, a.angle);
    b.angle = select(at_limit, b.angle + inertia_b * impulse, b.angle);
    is_near = ~at_limit | (select(state.at_lower, -beyond_lower, beyond_upper) <= slop);
  }

  const Vec2<W> arm_a = rotate(rotation_of<W>(a.angle), Vec2<W>{model.arm_a_x, model.arm_a_y});
  const Vec2<W> arm_b = rotate(rotation_of<W>(b.angle), Vec2<W>{model.arm_b_x, model.arm_b_y});
  const Vec2<W> gap = ((b.center + arm_b) - a.center) - arm_a;
  const Number<W> distance = simd::sqrt(gap.x * gap.x + gap.y * gap.y);
  const Number<W> kxx =
      mass_a + mass_b + inertia_a * arm_a.y * arm_a.y + inertia_b * arm_b.y * arm_b.y;
  const Number<W> kxy = -inertia_a * arm_a.x * arm_a.y - inertia_b * arm_b.x * arm_b.y;
  const Number<W> kyy =
      mass_a + mass_b + inertia_a * arm_a.x * arm_a.x + inertia_b * arm_b.x * arm_b.x;
  const Number<W> inverse = inverse_of(kxx * kyy - kxy * kxy);
  const Vec2<W> impulse{-(inverse * (kyy * gap.x - kxy * gap.y)),
                        -(inverse * (kxx * gap.y - kxy * gap.x))};
  a.center = a.center - mass_a * impulse;
  a.angle -= inertia_a * cross(arm_a, impulse);
  b.center = b.center + mass_b * impulse;
  b.angle += inertia_b * cross(arm_b, impulse);
  return is_near & (distance <= Number<W>(kLinearSlop));
}

}  // namespace WALKER_SIM_INSTRUCTION_SET
}  // namespace walker::bipedal_walker::kernel
