// A step of many b2Worlds in pieces, between which the kernel solves them together. This file has
// b2World::Step and Solve; world_toi.h has SolveTOI.
//
//   begin -> [solve island] -> finish_island -> WorldToi -> end
//
// Supports the worlds that Physics builds: one island of five bodies, in a chain of four joints,
// and their contacts with static ground; no sensors, no bullets, no damping, no restitution. Box2D
// collects the island along the chain, so that joints are in its order and contacts are sorted by
// body. A contact affects only its own body, so the order of the bodies does not matter. Box2D
// itself solves what the kernel does not support: sleeping bodies, too many contacts, and
// non-finite results.
//
// Compiled with -fno-access-control: a step's pieces are private to Box2D's classes.
//
// Restates formulas of Box2D 2.3, Copyright (c) 2006-2011 Erin Catto http://www.box2d.org, in code
// of our own, which is not the original software. kernel/lanes.h has the terms.
#include <algorithm>
#include <array>
#include <exception>
#include <new>
#include <type_traits>

#include "base/limits.h"
#include "robots/bipedal_walker/box2d_pinned/world_toi.h"
#include "simd/lane_memory.h"

namespace walker::bipedal_walker {
namespace {

b2Transform transform_of(const Rotation<float>& rotation, const b2Vec2& center,
                         const b2Body& body) {
  b2Transform transform;
  transform.q.s = rotation.sine;
  transform.q.c = rotation.cosine;
  transform.p = center - b2Mul(transform.q, body.m_sweep.localCenter);
  return transform;
}

/// Returns the model that all instances of `Physics` share, read from any of them.
Model model_of(const WalkerParts& parts) {
  Model model{};
  for (std::size_t i = 0; i < kBodies; ++i) {
    const b2Vec2& center = parts.bodies[i]->m_sweep.localCenter;
    model.bodies[i] = {center.x, center.y};
  }
  for (std::size_t i = 0; i < kJoints; ++i) {
    const b2RevoluteJoint& joint = *parts.joints[i];
    const b2Vec2 arm_a = joint.m_localAnchorA - joint.m_bodyA->m_sweep.localCenter;
    const b2Vec2 arm_b = joint.m_localAnchorB - joint.m_bodyB->m_sweep.localCenter;
    model.joints[i] = {
        arm_a.x,           arm_a.y, arm_b.x, arm_b.y, joint.m_referenceAngle, joint.m_lowerAngle,
        joint.m_upperAngle};
  }
  model.gravity_x = parts.world->m_gravity.x;
  model.dt = static_cast<float>(1.0 / kStepsPerSecond);
  model.dt_ratio = 1.0F / model.dt * model.dt;
  model.velocity_iterations = kVelocityIterations;
  model.position_iterations = kPositionIterations;
  return model;
}

/// One instance's step up to its impacts: contacts, island (IslandLanes) and sleep.
///
/// A body rests if |v| <= 0.01 m/s and |w| <= 2 degrees/s. The walker falls asleep when all bodies
/// have rested for 0.5 s and the positions are solved; the next `Physics::drive` wakes it.
///
/// Source: Box2D (box2d-py 2.3.8), Dynamics/b2World.cpp, b2World::Step and Solve;
/// Dynamics/b2Island.cpp, the end of b2Island::Solve.
class WorldStep {
 public:
  /// Updates the contacts.
  /// @return whether the kernel must solve `island`; if not, Box2D has solved it
  bool begin(const WalkerParts& parts, const Model& model) {
    parts_ = parts;
    model_ = &model;
    b2World& world = *parts_.world;
    if ((world.m_flags & b2World::e_newFixture) != 0) {
      world.m_contactManager.FindNewContacts();
      world.m_flags &= ~b2World::e_newFixture;
    }
    world.m_flags |= b2World::e_locked;
    world.m_contactManager.Collide();
    if (read_island()) return true;
    solve_by_box2d();
    return false;
  }

  Island& island() { return island_; }

  void finish_island() {
    if (!std::all_of(island_.bodies.begin(), island_.bodies.end(), is_finite)) {
      solve_by_box2d();
      return;
    }
    write_impulses();
    write_bodies();
    set_ground_awake(true);  // as Box2D's island search does
    fall_asleep();
    synchronize();
    parts_.world->m_contactManager.FindNewContacts();
  }

  void end() {
    b2World& world = *parts_.world;
    world.m_inv_dt0 = 1.0F / model_->dt;
    if ((world.m_flags & b2World::e_clearForces) != 0) {
      for (b2Body* body : parts_.bodies) {
        body->m_force.SetZero();
        body->m_torque = 0;
      }
    }
    // Box2D does this at the beginning of the next step. Ground without a contact still has 0.
    for (b2Contact* contact = world.GetContactList(); contact != nullptr;
         contact = contact->m_next) {
      ground_of(*contact).m_sweep.alpha0 = 0;
    }
    world.m_flags &= ~b2World::e_locked;
  }

 private:
  /// @return whether the kernel supports the island
  bool read_island() {
    // In a world's first step the ratio is 0, as are the impulses that it scales.
    const float dt_ratio = dt_ratio_of(*parts_.world, *model_);
    if (dt_ratio != model_->dt_ratio && dt_ratio != 0) return false;
    unsigned counts = 0;  // numbers of contacts, one digit per body
    num_contacts_ = 0;
    num_pairs_ = 0;
    for (std::size_t i = 0; i < kBodies; ++i) {
      const b2Body& body = *parts_.bodies[i];
      if (!body.IsAwake()) return false;
      island_.bodies[i] = state_of(body);
      island_.forces[i] = {body.m_force.x, body.m_force.y, body.m_torque};
      island_.inverse_masses[i] = inverse_mass_of(body);
      const int before = num_contacts_;
      if (!read_contacts(body)) return false;
      island_.num_contacts[i] = num_contacts_ - before;
      counts = (kMaxContactsOfBody + 1) * counts + static_cast<unsigned>(island_.num_contacts[i]);
    }
    island_.gravity_y = parts_.world->m_gravity.y;
    // The most expensive constraints are the most significant digits.
    island_.pattern = ((kMaxContacts + 1) * counts + num_pairs_) << kJoints;
    island_.pattern += read_joints();
    return true;
  }

  /// @return whether the island has room for the body's contacts
  bool read_contacts(const b2Body& body) {
    const int capacity = std::min(kMaxContacts, num_contacts_ + kMaxContactsOfBody);
    for (const b2ContactEdge* edge = body.m_contactList; edge != nullptr; edge = edge->next) {
      b2Contact& contact = *edge->contact;
      if (!is_solid(contact)) continue;
      if (num_contacts_ == capacity) return false;
      const b2Manifold& manifold = contact.m_manifold;
      Contact<float, int>& read = island_.contacts[static_cast<std::size_t>(num_contacts_)];
      read_contact(contact, body, read.manifold);
      for (int k = 0; k < b2_maxManifoldPoints; ++k) {
        const bool exists = k < manifold.pointCount;
        read.impulses.normal[k] = exists ? manifold.points[k].normalImpulse : 0;
        read.impulses.tangent[k] = exists ? manifold.points[k].tangentImpulse : 0;
      }
      contacts_[static_cast<std::size_t>(num_contacts_++)] = &contact;
      num_pairs_ += manifold.pointCount == 2 ? 1U : 0U;
    }
    return true;
  }

  /// @return a bit mask of the joints that are at a limit
  unsigned read_joints() {
    unsigned limits = 0;
    for (std::size_t i = 0; i < kJoints; ++i) {
      const b2RevoluteJoint& joint = *parts_.joints[i];
      const bool at_lower = joint.m_limitState == e_atLowerLimit;
      const bool at_upper = joint.m_limitState == e_atUpperLimit;
      island_.joints[i] = {joint.m_motorSpeed, joint.m_maxMotorTorque, joint.m_impulse.x,
                           joint.m_impulse.y,  joint.m_impulse.z,      joint.m_motorImpulse,
                           truth(at_lower),    truth(at_upper)};
      limits += at_lower || at_upper ? 1U << i : 0;
    }
    return limits;
  }

  void solve_by_box2d() { parts_.world->Solve(whole_step(*parts_.world, *model_)); }

  void write_impulses() {
    for (int i = 0; i < num_contacts_; ++i) {
      b2Manifold& manifold = contacts_[static_cast<std::size_t>(i)]->m_manifold;
      const ContactImpulses<float>& impulses =
          island_.contacts[static_cast<std::size_t>(i)].impulses;
      for (int k = 0; k < b2_maxManifoldPoints; ++k) {
        if (k == manifold.pointCount) break;
        manifold.points[k].normalImpulse = impulses.normal[k];
        manifold.points[k].tangentImpulse = impulses.tangent[k];
      }
    }
    for (std::size_t i = 0; i < kJoints; ++i) {
      b2RevoluteJoint& joint = *parts_.joints[i];
      const JointState<float, int>& state = island_.joints[i];
      joint.m_impulse.Set(state.impulse_x, state.impulse_y, state.limit_impulse);
      joint.m_motorImpulse = state.motor_impulse;
      joint.m_limitState = e_inactiveLimit;
      if (state.at_lower != 0) joint.m_limitState = e_atLowerLimit;
      if (state.at_upper != 0) joint.m_limitState = e_atUpperLimit;
    }
  }

  void write_bodies() {
    for (std::size_t i = 0; i < kBodies; ++i) {
      b2Body& body = *parts_.bodies[i];
      body.m_sweep.c0 = body.m_sweep.c;
      body.m_sweep.a0 = body.m_sweep.a;
      set_state(body, island_.bodies[i]);
      body.m_xf = transform_of(island_.rotations[i], body.m_sweep.c, body);
    }
  }

  void set_ground_awake(bool is_awake) {
    std::for_each_n(contacts_.begin(), num_contacts_,
                    [=](b2Contact* contact) { ground_of(*contact).SetAwake(is_awake); });
  }

  /// The end of b2Island::Solve.
  void fall_asleep() {
    if (!parts_.world->m_allowSleep) return;
    float shortest = b2_maxFloat;
    for (b2Body* body : parts_.bodies) {
      const bool moves = (body->m_flags & b2Body::e_autoSleepFlag) == 0 ||
                         body->m_angularVelocity * body->m_angularVelocity >
                             b2_angularSleepTolerance * b2_angularSleepTolerance ||
                         b2Dot(body->m_linearVelocity, body->m_linearVelocity) >
                             b2_linearSleepTolerance * b2_linearSleepTolerance;
      body->m_sleepTime = moves ? 0 : body->m_sleepTime + model_->dt;
      shortest = b2Min(shortest, body->m_sleepTime);
    }
    if (shortest < b2_timeToSleep || island_.position_is_solved == 0) return;
    for (b2Body* body : parts_.bodies) body->SetAwake(false);
    set_ground_awake(false);
  }

  /// Updates fixtures in the order of the world's list of bodies, which affects the tree's
  /// structure.
  void synchronize() {
    constexpr std::array<std::size_t, kBodies> kOrder{0, 1, 4, 3, 2};  // the newest body first
    b2BroadPhase& broad_phase = parts_.world->m_contactManager.m_broadPhase;
    for (const std::size_t i : kOrder) {
      b2Body& body = *parts_.bodies[i];
      const b2Transform before = transform_of(island_.rotations_before[i], body.m_sweep.c0, body);
      for (b2Fixture* fixture = body.m_fixtureList; fixture != nullptr; fixture = fixture->m_next) {
        fixture->Synchronize(&broad_phase, before, body.m_xf);
      }
    }
  }

  WalkerParts parts_;
  const Model* model_;
  Island island_;
  int num_contacts_;
  unsigned num_pairs_;                             ///< contacts with two points
  std::array<b2Contact*, kMaxContacts> contacts_;  ///< in the island's order
};

/// Solves problems, sorted so that similar ones share a vector.
template <typename Problem, typename Solve>
void solve_sorted(std::array<Problem*, kMaxGroupSize>& problems, std::size_t count,
                  const Solve& solve, const Model& model) {
  std::sort(problems.data(), problems.data() + count,
            [](const Problem* a, const Problem* b) { return a->pattern < b->pattern; });
  solve(problems.data(), count, model);
}

class Group {
 public:
  Group(const Kernel& kernel, PhysicsCall* calls, std::size_t count)
      : kernel_(kernel),
        calls_(calls),
        count_(count),
        model_(model_of(calls[0].physics->parts())) {}

  void step() {
    solve_islands();
    solve_toi();
    for_each([this](std::size_t i) { steps_[i].end(); });
  }

 private:
  void solve_islands() {
    std::array<Island*, kMaxGroupSize> islands;
    std::size_t num_islands = 0;
    std::array<bool, kMaxGroupSize> is_waiting{};
    for_each([&](std::size_t i) {
      is_waiting[i] = steps_[i].begin(calls_[i].physics->parts(), model_);
      if (is_waiting[i]) islands[num_islands++] = &steps_[i].island();
    });
    solve_sorted(islands, num_islands, kernel_.solve, model_);
    for_each([&](std::size_t i) {
      if (is_waiting[i]) steps_[i].finish_island();
    });
  }

  /// Solves one impact of each instance at a time, until no instance has another one.
  void solve_toi() {
    std::array<bool, kMaxGroupSize> is_waiting{};
    for_each([&](std::size_t i) {
      tois_[i].begin(calls_[i].physics->parts(), model_);
      is_waiting[i] = true;
    });
    for (;;) {
      std::array<ToiIsland*, kMaxGroupSize> islands;
      std::size_t num_islands = 0;
      for_each([&](std::size_t i) {
        is_waiting[i] = is_waiting[i] && tois_[i].find();
        if (is_waiting[i]) islands[num_islands++] = &tois_[i].island();
      });
      if (num_islands == 0) return;
      solve_sorted(islands, num_islands, kernel_.solve_toi, model_);
      for_each([&](std::size_t i) {
        if (is_waiting[i]) tois_[i].finish();
      });
    }
  }

  /// Calls function(i) for each instance that has not failed, and records exceptions.
  template <typename Function>
  void for_each(const Function& function) {
    for (std::size_t i = 0; i < count_; ++i) {
      if (*calls_[i].failure) continue;
      try {
        function(i);
      } catch (...) {
        *calls_[i].failure = std::current_exception();
      }
    }
  }

  const Kernel& kernel_;
  PhysicsCall* calls_;
  std::size_t count_;
  Model model_;
  std::array<WorldStep, kMaxGroupSize> steps_;
  std::array<WorldToi, kMaxGroupSize> tois_;
};

}  // namespace

void step_together(const Kernel& kernel, PhysicsCall* calls, std::size_t count) noexcept {
  if (count == 0) return;
  static_assert(sizeof(Group) <= simd::LaneMemory::kGroupSize);
  static_assert(std::is_trivially_destructible_v<Group>);
  try {
    auto* const group = new (simd::lane_memory().group) Group(kernel, calls, count);
    group->step();
  } catch (...) {  // out of memory
    std::for_each(calls, calls + count,
                  [](const PhysicsCall& call) { *call.failure = std::current_exception(); });
  }
}

}  // namespace walker::bipedal_walker
