// The velocity iterations of a single instance, whose speed is limited by latency: each constraint
// waits for the one before. They perform the operations of revolute_joint.h and contact.h, with
// two differences that shorten the wait:
//
// - A vector holds all velocities of one body instead of one number of many instances.
// - Clamps and limits are branches. The processor predicts them, because most constraints stay in
//   the same case for all iterations, and so need not wait for the value that decides.
//
// A body is (w, vx, vy, 0), an impulse (z, Px, Py, 0), and a body's `masses` are (i, m, m, 0). A
// constraint that computes the impulse P at the arm r, and the angular impulse z, then does
//
//   body += masses * (r x P + z, Px, Py, 0),   w x r = w * (0, -ry, rx, 0)
//
// with the opposite sign for the joint's body A, and the sign of contact.h for contacts. The rules
// for P and z are those of revolute_joint.h (motor, point, limit) and contact.h (friction, normal).
//
// Restates formulas of Box2D 2.3, Copyright (c) 2006-2011 Erin Catto http://www.box2d.org, in code
// of our own, which is not the original software. lanes.h has the terms.
#pragma once

#include <array>

#include "robots/bipedal_walker/kernel/contact.h"
#include "robots/bipedal_walker/kernel/revolute_joint.h"

namespace walker::bipedal_walker::kernel {
inline namespace WALKER_SIM_INSTRUCTION_SET {

/// Angular velocity and velocity of a body, or angular impulse and impulse. The last lane is 0.
using Planar = Number<4>;

WALKER_SIM_INLINE inline Planar planar(float angular, float x, float y) {
  return Planar::of(Planar::Number{angular, x, y, 0});
}

WALKER_SIM_INLINE inline Planar planar(float angular, Vec2<1> a) {
  return planar(angular, a.x[0], a.y[0]);
}

WALKER_SIM_INLINE inline Planar with_angular(Planar a, float angular) {
  a.set(0, angular);
  return a;
}

WALKER_SIM_INLINE inline Planar swap_x_and_y(Planar a) {
  return Planar::of(Planar::Number{a[0], a[2], a[1], a[3]});
}

/// An arm from a body's centre of mass, in the forms in which products need it.
struct Arm {
  Arm() = default;
  explicit Arm(Vec2<1> arm, float sign = 1)
      : turned(planar(0, sign * -arm.y[0], sign * arm.x[0])),
        swapped(planar(0, arm.y[0], arm.x[0])) {}

  Planar turned;
  Planar swapped;
};

/// b2Cross(w, arm) of a body's angular velocity w, times the arm's sign.
WALKER_SIM_INLINE inline Planar cross(Planar body, const Arm& arm) {
  return Planar(body[0]) * arm.turned;
}

/// b2Cross(arm, impulse).
WALKER_SIM_INLINE inline float cross(const Arm& arm, Planar impulse) {
  const Planar products = arm.swapped * impulse;
  return products[2] - products[1];
}

WALKER_SIM_INLINE inline float dot(Planar a, Planar b) {
  const Planar products = a * b;
  return products[1] + products[2];
}

/// Prevents the compiler from replacing the enclosing branch by a selection.
WALKER_SIM_INLINE inline void keep_branch() { __asm__ volatile(""); }

/// b2Clamp.
WALKER_SIM_INLINE inline float clamp_by_branch(float a, float low, float high) {
  if (!(a < high)) {
    keep_branch();
    a = high;
  }
  if (low > a) {
    keep_branch();
    a = low;
  }
  return a;
}

/// JointLanes of one instance.
struct SingleJoint {
  // cppcheck-suppress uninitMemberVar  // is overwritten
  SingleJoint() = default;
  SingleJoint(const JointLanes<1>& joint, const InverseMass<Number<1>>& a,
              const InverseMass<Number<1>>& b)
      : lanes(joint),
        arm_a(joint.arm_a),
        arm_b(joint.arm_b),
        masses_a(planar(a.inertia[0], a.mass[0], a.mass[0])),
        masses_b(planar(b.inertia[0], b.mass[0], b.mass[0])),
        minus_diagonal(planar(0, -joint.eyy[0], -joint.exx[0])),
        minus_off_diagonal(planar(0, -joint.exy[0], -joint.exy[0])),
        inverse_determinant(planar(0, joint.inverse_determinant[0], joint.inverse_determinant[0])),
        impulse(planar(0, joint.impulse)),
        minus_motor_mass(-joint.motor_mass[0]),
        min_motor_impulse(-joint.max_motor_impulse[0]),
        at_lower(any(joint.at_lower)),
        at_upper(any(joint.at_upper)) {}

  void store(JointLanes<1>& joint) const {
    joint = lanes;
    joint.impulse = {impulse[1], impulse[2]};
  }

  JointLanes<1> lanes;
  Arm arm_a, arm_b;
  Planar masses_a, masses_b;
  Planar minus_diagonal, minus_off_diagonal, inverse_determinant;
  Planar impulse;
  float minus_motor_mass, min_motor_impulse;
  bool at_lower, at_upper;
};

/// b2Mat33::Solve22 of the negated argument.
WALKER_SIM_INLINE inline Planar solve_22_negated(const SingleJoint& joint, Planar right) {
  return joint.inverse_determinant *
         (joint.minus_diagonal * right - joint.minus_off_diagonal * swap_x_and_y(right));
}

/// b2Mat33::Solve33, negated.
WALKER_SIM_INLINE inline Planar solve_33_negated(const JointLanes<1>& joint, float bx, float by,
                                                 float bz) {
  const float exx = joint.exx[0];
  const float exy = joint.exy[0];
  const float exz = joint.exz[0];
  const float eyy = joint.eyy[0];
  const float eyz = joint.eyz[0];
  const float ezz = joint.ezz[0];
  const float d = joint.inverse_determinant_3[0];
  return planar(
      -(d *
        (exx * (eyy * bz - eyz * by) + exy * (eyz * bx - exy * bz) + exz * (exy * by - eyy * bx))),
      -(d * (bx * joint.eyz_cross_x[0] + by * joint.eyz_cross_y[0] + bz * joint.eyz_cross_z[0])),
      -(d *
        (exx * (by * ezz - bz * eyz) + exy * (bz * exz - bx * ezz) + exz * (bx * eyz - by * exz))));
}

/// b2RevoluteJoint::SolveVelocityConstraints.
WALKER_SIM_INLINE inline void solve(SingleJoint& joint, Planar& a, Planar& b) {
  const float error = b[0] - a[0] - joint.lanes.motor_speed[0];
  const float before = joint.lanes.motor_impulse[0];
  const float accumulated =
      clamp_by_branch(before + joint.minus_motor_mass * error, joint.min_motor_impulse,
                      joint.lanes.max_motor_impulse[0]);
  const float torque = accumulated - before;
  joint.lanes.motor_impulse = accumulated;
  a = with_angular(a, a[0] - joint.masses_a[0] * torque);
  b = with_angular(b, b[0] + joint.masses_b[0] * torque);

  const Planar slip = ((b + cross(b, joint.arm_b)) - a) - cross(a, joint.arm_a);
  Planar impulse;
  float angular_a;
  float angular_b;
  if (joint.at_lower || joint.at_upper) {
    const Planar with_limit = solve_33_negated(joint.lanes, slip[1], slip[2], b[0] - a[0]);
    const float held_before = joint.lanes.limit_impulse[0];
    const float held = held_before + with_limit[0];
    float angular;
    if (joint.at_lower ? held < 0 : held > 0) {
      const Planar ez = planar(0, joint.lanes.exz[0], joint.lanes.eyz[0]);
      impulse = solve_22_negated(joint, -(Planar(held_before) * ez - slip));
      angular = -held_before;
      joint.lanes.limit_impulse = 0;
    } else {
      impulse = with_limit;
      angular = with_limit[0];
      joint.lanes.limit_impulse = held;
    }
    angular_a = cross(joint.arm_a, impulse) + angular;
    angular_b = cross(joint.arm_b, impulse) + angular;
  } else {
    impulse = solve_22_negated(joint, slip);
    angular_a = cross(joint.arm_a, impulse);
    angular_b = cross(joint.arm_b, impulse);
  }
  joint.impulse = joint.impulse + impulse;
  a = a - joint.masses_a * with_angular(impulse, angular_a);
  b = b + joint.masses_b * with_angular(impulse, angular_b);
}

/// ContactLanes of one instance.
struct SingleContact {
  struct Point {
    Arm arm;
    Planar zero;
    float minus_normal_mass, minus_tangent_mass;
    float normal_impulse, tangent_impulse;
  };

  // cppcheck-suppress uninitMemberVar  // is overwritten, if it exists
  SingleContact() = default;
  explicit SingleContact(const ContactLanes<1>& contact)
      : normal(planar(0, contact.normal)),
        tangent(planar(0, tangent_of(contact.normal))),
        sign(planar(1, contact.sign[0], contact.sign[0])),
        signed_masses(
            planar(contact.signed_inertia[0], contact.signed_mass[0], contact.signed_mass[0])),
        friction(contact.friction[0]),
        k(contact.k),
        inverse_k(contact.inverse_k),
        has_two(any(contact.has_two)) {
    for (int i = 0; i < 2; ++i) {
      const PointLanes<1>& point = contact.points[i];
      points[i] = {Arm(point.arm, contact.sign[0]),
                   // The sum of `zero_before` and of minus `zero_after`, negated. Subtracting it
                   // from the velocity, before `cross` is added, gives the same bits.
                   contact.any_walker_is_a ? planar(0, -0.0F, -0.0F) : planar(0, point.zero_after),
                   -point.normal_mass[0], -point.tangent_mass[0], point.normal_impulse[0],
                   point.tangent_impulse[0]};
    }
  }

  void store(ContactLanes<1>& contact) const {
    for (int i = 0; i < 2; ++i) {
      contact.points[i].normal_impulse = points[i].normal_impulse;
      contact.points[i].tangent_impulse = points[i].tangent_impulse;
    }
  }

  Planar normal, tangent;
  Planar sign, signed_masses;
  std::array<Point, 2> points;
  float friction;
  Mat22<1> k, inverse_k;
  bool has_two;
};

/// Returns dv, the velocity of B at the point relative to A.
WALKER_SIM_INLINE inline Planar relative_velocity(const SingleContact& contact,
                                                  const SingleContact::Point& point, Planar body) {
  return (contact.sign * body - point.zero) + cross(body, point.arm);
}

/// Applies an impulse to the walker's body.
WALKER_SIM_INLINE inline void apply(const SingleContact& contact, Planar impulse, float angular,
                                    Planar& body) {
  body = body + contact.signed_masses * with_angular(impulse, angular);
}

WALKER_SIM_INLINE inline void solve_tangent(const SingleContact& contact,
                                            SingleContact::Point& point, Planar& body) {
  const float speed = dot(relative_velocity(contact, point, body), contact.tangent);
  const float max_friction = contact.friction * point.normal_impulse;
  const float accumulated = clamp_by_branch(
      point.tangent_impulse + point.minus_tangent_mass * speed, -max_friction, max_friction);
  const Planar impulse = Planar(accumulated - point.tangent_impulse) * contact.tangent;
  point.tangent_impulse = accumulated;
  apply(contact, impulse, cross(point.arm, impulse), body);
}

WALKER_SIM_INLINE inline void solve_normal(const SingleContact& contact,
                                           SingleContact::Point& point, Planar& body) {
  const float speed = dot(relative_velocity(contact, point, body), contact.normal);
  float accumulated = point.normal_impulse + point.minus_normal_mass * speed;
  if (!(accumulated > 0)) {
    keep_branch();
    accumulated = 0;
  }
  const Planar impulse = Planar(accumulated - point.normal_impulse) * contact.normal;
  point.normal_impulse = accumulated;
  apply(contact, impulse, cross(point.arm, impulse), body);
}

/// Block solver, as `solve_two_normals` of contact.h.
WALKER_SIM_INLINE inline void solve_two_normals(SingleContact& contact, Planar& body) {
  SingleContact::Point& point_1 = contact.points[0];
  SingleContact::Point& point_2 = contact.points[1];
  const Mat22<1>& k = contact.k;
  const Mat22<1>& inverse_k = contact.inverse_k;
  const Number<1> a_1 = point_1.normal_impulse;
  const Number<1> a_2 = point_2.normal_impulse;
  const Number<1> b_1 = Number<1>(dot(relative_velocity(contact, point_1, body), contact.normal)) -
                        (k.ex.x * a_1 + k.ey.x * a_2);
  const Number<1> b_2 = Number<1>(dot(relative_velocity(contact, point_2, body), contact.normal)) -
                        (k.ex.y * a_1 + k.ey.y * a_2);
  const auto is_valid = [](Number<1> a, Number<1> b)
                            WALKER_SIM_INLINE { return a[0] >= 0 && b[0] >= 0; };
  Number<1> x_1 = -(inverse_k.ex.x * b_1 + inverse_k.ey.x * b_2);
  Number<1> x_2 = -(inverse_k.ex.y * b_1 + inverse_k.ey.y * b_2);
  if (!is_valid(x_1, x_2)) {
    x_1 = Number<1>(point_1.minus_normal_mass) * b_1;
    x_2 = 0;
    if (!is_valid(x_1, k.ex.y * x_1 + b_2)) {
      x_1 = 0;
      x_2 = Number<1>(point_2.minus_normal_mass) * b_2;
      if (!is_valid(x_2, k.ey.x * x_2 + b_1)) {
        x_2 = 0;
        if (!is_valid(b_1, b_2)) return;
      }
    }
  }
  const Planar impulse_1 = Planar((x_1 - a_1)[0]) * contact.normal;
  const Planar impulse_2 = Planar((x_2 - a_2)[0]) * contact.normal;
  point_1.normal_impulse = x_1[0];
  point_2.normal_impulse = x_2[0];
  apply(contact, impulse_1 + impulse_2,
        cross(point_1.arm, impulse_1) + cross(point_2.arm, impulse_2), body);
}

/// b2ContactSolver::SolveVelocityConstraints for the contacts of one body. Not inlined: the code of
/// the joints around each call then keeps more numbers in registers.
/// @param body    velocities before
/// @return velocities after
__attribute__((noinline)) inline Planar::Number solve(SingleContact* begin,
                                                      const SingleContact* end,
                                                      Planar::Number body) {
  Planar now = Planar::of(body);
  for (SingleContact* contact = begin; contact != end; ++contact) {
    solve_tangent(*contact, contact->points[0], now);
    if (contact->has_two) {
      solve_tangent(*contact, contact->points[1], now);
      solve_two_normals(*contact, now);
    } else {
      solve_normal(*contact, contact->points[0], now);
    }
  }
  return now.number;
}

/// The constraints of a single instance. This is a member of an object and no local variable, so
/// that the compiler leaves it in memory and keeps registers for the bodies.
class SingleInstance {
 public:
  /// Runs all velocity iterations, in the order of IslandLanes::solve_velocities.
  /// @param first_contacts indices of each body's first contact, and the number of contacts
  void solve(int iterations, const std::array<InverseMass<Number<1>>, kBodies>& masses,
             const std::array<int, kBodies + 1>& first_contacts,
             std::array<JointLanes<1>, kJoints>& joints,
             std::array<ContactLanes<1>, kMaxContactsInLanes>& contacts,
             std::array<BodyLanes<1>, kBodies>& bodies) {
    for (int i = 0; i < kJoints; ++i) {
      joints_[i] = SingleJoint(joints[i], masses[body_a(i)], masses[body_b(i)]);
    }
    const int num_contacts = first_contacts[kBodies];
    for (int i = 0; i < num_contacts; ++i) contacts_[i] = SingleContact(contacts[i]);
    iterate(iterations, first_contacts, bodies);
    for (int i = 0; i < kJoints; ++i) joints_[i].store(joints[i]);
    for (int i = 0; i < num_contacts; ++i) contacts_[i].store(contacts[i]);
  }

 private:
  void iterate(int iterations, const std::array<int, kBodies + 1>& first_contacts,
               std::array<BodyLanes<1>, kBodies>& bodies) {
    const auto read = [&bodies](int index) {
      return planar(bodies[index].angular_velocity[0], bodies[index].velocity);
    };
    const auto write = [&bodies](int index, Planar body) {
      bodies[index] = {{body[1], body[2]}, body[0]};
    };
    const auto solve_contacts = [&](int index, Planar& body) WALKER_SIM_INLINE {
      SingleContact* const begin = contacts_.data() + first_contacts[index];
      SingleContact* const end = contacts_.data() + first_contacts[index + 1];
      if (begin != end) body = Planar::of(kernel::solve(begin, end, body.number));
    };
    auto& [first_knee, first_hip, second_hip, second_knee] = joints_;
    Planar first_lower_leg = read(0);
    Planar first_upper_leg = read(1);
    Planar hull = read(2);
    Planar second_upper_leg = read(3);
    Planar second_lower_leg = read(4);
    kernel::solve(first_knee, first_upper_leg, first_lower_leg);
    kernel::solve(first_hip, hull, first_upper_leg);
    solve_contacts(0, first_lower_leg);
    solve_contacts(1, first_upper_leg);
    for (int i = 1; i < iterations; ++i) {
      kernel::solve(second_hip, hull, second_upper_leg);
      kernel::solve(first_knee, first_upper_leg, first_lower_leg);  // of the next iteration
      solve_contacts(2, hull);
      kernel::solve(second_knee, second_upper_leg, second_lower_leg);
      kernel::solve(first_hip, hull, first_upper_leg);  // of the next iteration
      solve_contacts(3, second_upper_leg);
      solve_contacts(4, second_lower_leg);
      solve_contacts(0, first_lower_leg);  // of the next iteration
      solve_contacts(1, first_upper_leg);  // of the next iteration
    }
    kernel::solve(second_hip, hull, second_upper_leg);
    kernel::solve(second_knee, second_upper_leg, second_lower_leg);
    solve_contacts(2, hull);
    solve_contacts(3, second_upper_leg);
    solve_contacts(4, second_lower_leg);
    write(0, first_lower_leg);
    write(1, first_upper_leg);
    write(2, hull);
    write(3, second_upper_leg);
    write(4, second_lower_leg);
  }

  std::array<SingleJoint, kJoints> joints_;
  std::array<SingleContact, kMaxContactsInLanes> contacts_;
};

}  // namespace WALKER_SIM_INSTRUCTION_SET
}  // namespace walker::bipedal_walker::kernel
