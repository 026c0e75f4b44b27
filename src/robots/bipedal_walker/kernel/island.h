// b2Island::Solve for one walker per lane: applies forces, solves velocities (180 iterations),
// integrates positions, and corrects positions (up to 60 iterations).
//
// With the centre of mass c [m], angle a [rad], velocities v and w, inverse mass m and inertia i of
// a body, and the force F and torque T on it:
//
//   forces      v += dt (g + m F),   w += dt i T
//   warm start  applies the last step's impulses times dt_ratio to v and w: contacts, then joints
//   velocities  180 times: each joint's motor, point and limit, then each contact's friction and
//               normal impulses. Each constraint changes v and w so that it holds by itself
//               (sequential impulses, projected Gauss-Seidel)
//   limits      v = (2 / |dt v|) v if |dt v| > 2 m,   w = (pi/2 / |dt w|) w if |dt w| > pi/2
//   integrate   c += dt v,   a += dt w
//   correction  at most 60 times: contacts, then joints move c and a against their position errors,
//               until all separations are at least -3 b2_linearSlop and each joint is within
//               b2_linearSlop, and at a limit within b2_angularSlop
//
// revolute_joint.h and contact.h have the constraints' equations. Inputs: forces, motors and
// manifolds. State: c, a, v, w, and the accumulated impulses. Units: m, rad, kg, s.
//
// Source: Box2D (box2d-py 2.3.8), Dynamics/b2Island.cpp, b2Island::Solve.
//
// Restates formulas of Box2D 2.3, Copyright (c) 2006-2011 Erin Catto http://www.box2d.org, in code
// of our own, which is not the original software. lanes.h has the terms.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <type_traits>

#include "robots/bipedal_walker/kernel/contact.h"
#include "robots/bipedal_walker/kernel/revolute_joint.h"
#include "robots/bipedal_walker/kernel/single_instance.h"

namespace walker::bipedal_walker::kernel {
inline namespace WALKER_SIM_INSTRUCTION_SET {

constexpr int kHull = kBodies / 2;

constexpr float kMaxTranslation = 2;        ///< b2_maxTranslation [m]
constexpr float kMaxRotation = 0.5F * kPi;  ///< b2_maxRotation [rad]
constexpr float kBaumgarte = 0.2F;          ///< b2_baumgarte

/// The end of b2Island::Solve and SolveTOI: limits velocities and integrates positions.
template <int W>
WALKER_SIM_INLINE inline void integrate(Number<W> dt, BodyState<Number<W>>& body) {
  const Vec2<W> velocity{body.velocity_x, body.velocity_y};
  const Vec2<W> translation = dt * velocity;
  const Number<W> squared = dot(translation, translation);
  const Truth<W> is_far = squared > Number<W>(kMaxTranslation * kMaxTranslation);
  const Number<W> slower = Number<W>(kMaxTranslation) / simd::sqrt(squared);
  const Vec2<W> limited = select(is_far, slower * velocity, velocity);
  const Number<W> rotation = dt * body.angular_velocity;
  const Truth<W> is_wide = rotation * rotation > Number<W>(kMaxRotation * kMaxRotation);
  const Number<W> size = select(rotation > Number<W>(0), rotation, -rotation);  // b2Abs
  body.angular_velocity = select(is_wide, body.angular_velocity * (Number<W>(kMaxRotation) / size),
                                 body.angular_velocity);
  body.velocity_x = limited.x;
  body.velocity_y = limited.y;
  body.x += dt * limited.x;
  body.y += dt * limited.y;
  body.angle += dt * body.angular_velocity;
}

/// Runs position iterations. Each lane keeps the positions of the iteration in which it converges.
/// @param count   lanes that must converge
/// @param iterate returns the lanes in which all position errors are within tolerance
/// @return the lanes that have converged
template <int W, std::size_t N, typename Iterate>
WALKER_SIM_INLINE inline Truth<W> correct_positions(std::array<PositionLanes<W>, N>& positions,
                                                    int iterations, int count,
                                                    const Iterate& iterate) {
  std::array<PositionLanes<W>, N> kept = positions;
  Truth<W> is_kept = Truth<W>::none();
  const unsigned all = (1U << count) - 1;
  for (int i = 0; i < iterations && (to_bits(is_kept) & all) != all; ++i) {
    const Truth<W> has_converged = iterate() & ~is_kept;
    if (!any(has_converged)) continue;
    for (std::size_t k = 0; k < N; ++k) kept[k] = select(has_converged, positions[k], kept[k]);
    is_kept = is_kept | has_converged;
  }
  for (std::size_t k = 0; k < N; ++k) positions[k] = select(is_kept, kept[k], positions[k]);
  return is_kept;
}

/// Contacts of the same body, at the same index in each instance's list.
template <int W>
struct Slot {
  ManifoldLanes<W> manifold;
  int body;
  bool any_two;
};

/// The islands of up to W walkers. `solve` computes the velocities and integrates; `correct`, which
/// may be called again with the iterations that remain, corrects the positions. Both read the
/// islands and write their results back.
template <int W>
class IslandLanes {
 public:
  /// @param islands `count` islands, at most W; the results of other lanes are discarded
  IslandLanes(Island* const* islands, int count, const Model& model)
      : model_(model), count_(count) {
    for (int lane = 0; lane < W; ++lane) islands_[lane] = islands[lane < count ? lane : 0];
    assign_slots();
  }

  void solve() {
    load_state();
    prepare_velocities();
    if constexpr (W == 1) {
      single_instance_.solve(model_.velocity_iterations, inverse_masses_, first_slots_, joints_,
                             contacts_, velocities_);
    } else {
      solve_velocities();
    }
    for (int i = 0; i < kBodies; ++i) {
      bodies_[i].velocity_x = velocities_[i].velocity.x;
      bodies_[i].velocity_y = velocities_[i].velocity.y;
      bodies_[i].angular_velocity = velocities_[i].angular_velocity;
      integrate<W>(model_.dt, bodies_[i]);
    }
    store_impulses();
    store(bodies_, &Island::bodies);
  }

  void correct(int iterations) {
    load_state();
    for (int i = 0; i < kBodies; ++i) {
      positions_[i] = {{bodies_[i].x, bodies_[i].y}, bodies_[i].angle};
    }
    const Truth<W> is_solved = correct_positions(
        positions_, iterations, count_, [this]() WALKER_SIM_INLINE { return solve_positions(); });
    for (int i = 0; i < kBodies; ++i) {
      bodies_[i].x = positions_[i].center.x;
      bodies_[i].y = positions_[i].center.y;
      bodies_[i].angle = positions_[i].angle;
      rotations_[i] = rotation_of<W>(bodies_[i].angle);
    }
    store(bodies_, &Island::bodies);
    store(rotations_, &Island::rotations);
    for (int lane = 0; lane < count_; ++lane) {
      islands_[lane]->position_is_solved = (to_bits(is_solved) >> lane) & 1U;
    }
  }

 private:
  /// Assigns each contact of each instance to a slot of its body.
  void assign_slots() {
    static const Contact<float, int> kNone{};
    num_slots_ = 0;
    std::array<int, W> next{};  // index of each instance's next contact
    for (int body = 0; body < kBodies; ++body) {
      first_slots_[body] = num_slots_;
      int num_slots = 0;
      for (const Island* island : islands_) {
        num_slots = std::max(num_slots, island->num_contacts[body]);
      };
      for (int i = 0; i < num_slots; ++i) {
        Slot<W>& slot = slots_[num_slots_];
        std::array<const Contact<float, int>*, W> contacts;
        for (int lane = 0; lane < W; ++lane) {
          const bool exists = i < islands_[lane]->num_contacts[body];
          contact_indices_[num_slots_][lane] = exists ? next[lane]++ : -1;
          contacts[lane] =
              exists ? &islands_[lane]->contacts[contact_indices_[num_slots_][lane]] : &kNone;
        }
        Contact<Number<W>, Truth<W>> lanes;
        gather<W>(lanes, contacts.data());
        slot.body = body;
        slot.manifold = lanes.manifold;
        slot.any_two = any(lanes.manifold.has_two_points);
        impulses_[num_slots_] = lanes.impulses;
        ++num_slots_;
      }
    }
    first_slots_[kBodies] = num_slots_;
  }

  void load_state() {
    load(&Island::bodies, bodies_);
    load(&Island::joints, joint_states_);
    load(&Island::inverse_masses, inverse_masses_);
  }

  WALKER_SIM_INLINE MassLanes<W> mass_of(int body) const {
    const auto& [mass, inertia] = inverse_masses_[body];
    const Model::Body& model = model_.bodies[body];
    return {mass, inertia, {Number<W>(model.center_x), Number<W>(model.center_y)}};
  }

  template <typename Member, typename Lanes>
  void load(Member member, Lanes& lanes) const {
    std::array<const std::remove_reference_t<decltype(islands_[0]->*member)>*, W> instances;
    for (int lane = 0; lane < W; ++lane) instances[lane] = &(islands_[lane]->*member);
    gather<W>(lanes, instances.data());
  }

  template <typename Member, typename Lanes>
  void store(const Lanes& lanes, Member member) const {
    std::array<std::remove_reference_t<decltype(islands_[0]->*member)>*, W> instances;
    for (int lane = 0; lane < W; ++lane) instances[lane] = &(islands_[lane]->*member);
    scatter<W>(lanes, instances.data(), count_);
  }

  /// Applies forces, and initialises and warm-starts the constraints.
  void prepare_velocities() {
    const Number<W> dt(model_.dt);
    std::array<Force<Number<W>>, kBodies> forces;
    load(&Island::forces, forces);
    Number<W> gravity_y;
    load(&Island::gravity_y, gravity_y);
    for (int i = 0; i < kBodies; ++i) {
      const BodyState<Number<W>>& body = bodies_[i];
      const auto& [mass, inertia] = inverse_masses_[i];
      const Number<W> gravity_scale(1);
      rotations_[i] = rotation_of<W>(body.angle);
      velocities_[i].velocity = {
          body.velocity_x + dt * (gravity_scale * Number<W>(model_.gravity_x) + mass * forces[i].x),
          body.velocity_y + dt * (gravity_scale * gravity_y + mass * forces[i].y)};
      velocities_[i].angular_velocity = body.angular_velocity + dt * inertia * forces[i].torque;
    }
    store(rotations_, &Island::rotations_before);

    for (int i = 0; i < num_slots_; ++i) {
      const int body = slots_[i].body;
      const MassLanes<W> model = mass_of(body);
      const Vec2<W> center{bodies_[body].x, bodies_[body].y};
      const Transform<W> transform{rotations_[body],
                                   center - rotate(rotations_[body], model.center)};
      ContactLanes<W>& contact = contacts_[i];
      prepare(slots_[i].manifold, model, center, transform, contact);
      const Number<W> ratio(model_.dt_ratio);
      for (int k = 0; k < 2; ++k) {
        contact.points[k].normal_impulse = ratio * impulses_[i].normal[k];
        contact.points[k].tangent_impulse = ratio * impulses_[i].tangent[k];
      }
      warm_start(contact, velocities_[body]);
    }
    for (int i = 0; i < kJoints; ++i) {
      const int a = body_a(i);
      const int b = body_b(i);
      prepare(model_.joints[i], inverse_masses_[a], inverse_masses_[b], model_.dt, model_.dt_ratio,
              joint_states_[i], bodies_[a], bodies_[b], rotations_[a], rotations_[b], joints_[i],
              velocities_[a], velocities_[b]);
    }
  }

  /// Runs all velocity iterations, in an order that lets the processor overlap two constraints.
  /// Constraints without a common body are independent, so their order does not matter, and the leg
  /// at the chain's beginning may be one iteration ahead of the hull and the other leg.
  void solve_velocities() {
    const int hull = first_slots_[kHull];
    const int other_leg = first_slots_[kHull + 1];
    solve_joint<0>();
    solve_joint<1>();
    solve_contacts(0, hull);
    for (int i = 1; i < model_.velocity_iterations; ++i) {
      solve_joint<2>();
      solve_joint<0>();  // of the next iteration
      solve_contacts(hull, other_leg);
      solve_joint<3>();
      solve_joint<1>();  // of the next iteration
      solve_contacts(other_leg, num_slots_);
      solve_contacts(0, hull);  // of the next iteration
    }
    solve_joint<2>();
    solve_joint<3>();
    solve_contacts(hull, num_slots_);
  }

  template <int I>
  WALKER_SIM_INLINE void solve_joint() {
    constexpr int kA = body_a(I);
    constexpr int kB = body_b(I);
    kernel::solve(inverse_masses_[kA], inverse_masses_[kB], joints_[I], velocities_[kA],
                  velocities_[kB]);
  }

  WALKER_SIM_INLINE void solve_contacts(int begin, int end) {
    for (int i = begin; i < end; ++i) kernel::solve(contacts_[i], velocities_[slots_[i].body]);
  }

  /// b2ContactSolver::StoreImpulses, and the joints' impulses and limit states.
  void store_impulses() {
    for (int i = 0; i < kJoints; ++i) {
      const JointLanes<W>& joint = joints_[i];
      JointState<Number<W>, Truth<W>>& state = joint_states_[i];
      state.impulse_x = joint.impulse.x;
      state.impulse_y = joint.impulse.y;
      state.limit_impulse = joint.limit_impulse;
      state.motor_impulse = joint.motor_impulse;
      state.at_lower = joint.at_lower;
      state.at_upper = joint.at_upper;
    }
    store(joint_states_, &Island::joints);
    for (int i = 0; i < num_slots_; ++i) {
      const ContactLanes<W>& contact = contacts_[i];
      ContactImpulses<Number<W>>& impulses = impulses_[i];
      impulses.normal[0] = contact.points[0].normal_impulse;
      impulses.tangent[0] = contact.points[0].tangent_impulse;
      // A second point that was not solved keeps its impulses.
      impulses.normal[1] =
          select(contact.has_two, contact.points[1].normal_impulse, impulses.normal[1]);
      impulses.tangent[1] =
          select(contact.has_two, contact.points[1].tangent_impulse, impulses.tangent[1]);
      ContactImpulses<float> nowhere;
      std::array<ContactImpulses<float>*, W> instances;
      for (int lane = 0; lane < W; ++lane) {
        const int index = contact_indices_[i][lane];
        // cppcheck-suppress uninitvar  // it is only written
        instances[lane] = index < 0 ? &nowhere : &islands_[lane]->contacts[index].impulses;
      }
      scatter<W>(impulses, instances.data(), count_);
    }
  }

  WALKER_SIM_INLINE Truth<W> solve_positions() {
    Number<W> separation(0);
    for (int i = 0; i < num_slots_; ++i) {
      const int body = slots_[i].body;
      solve_position(slots_[i].manifold, slots_[i].any_two, mass_of(body), kBaumgarte,
                     positions_[body], separation);
    }
    Truth<W> is_near = separation >= Number<W>(-3.0F * kLinearSlop);
    for (int i = 0; i < kJoints; ++i) {
      const int a = body_a(i);
      const int b = body_b(i);
      is_near = is_near & solve_position(model_.joints[i], inverse_masses_[a], inverse_masses_[b],
                                         joint_states_[i], positions_[a], positions_[b]);
    }
    return is_near;
  }

  const Model& model_;
  int count_;
  std::array<Island*, W> islands_;
  int num_slots_;
  std::array<int, kBodies + 1> first_slots_;  ///< of each body; slots are sorted by body
  std::array<Slot<W>, kMaxContactsInLanes> slots_;
  std::array<std::array<int, W>, kMaxContactsInLanes> contact_indices_;
  std::array<ContactImpulses<Number<W>>, kMaxContactsInLanes> impulses_;
  std::array<ContactLanes<W>, kMaxContactsInLanes> contacts_;
  std::array<BodyState<Number<W>>, kBodies> bodies_;
  std::array<InverseMass<Number<W>>, kBodies> inverse_masses_;
  std::array<Rotation<Number<W>>, kBodies> rotations_;
  std::array<BodyLanes<W>, kBodies> velocities_;
  std::array<PositionLanes<W>, kBodies> positions_;
  std::array<JointState<Number<W>, Truth<W>>, kJoints> joint_states_;
  std::array<JointLanes<W>, kJoints> joints_;
  struct None {};
  std::conditional_t<W == 1, SingleInstance, None> single_instance_;
};

}  // namespace WALKER_SIM_INSTRUCTION_SET
}  // namespace walker::bipedal_walker::kernel
