// The second half of a step of one b2World, b2World::SolveTOI, in pieces:
//
//   begin -> (find -> [solve impact] -> finish)*
//
// Supports the same worlds as world_step.cpp. Only for files compiled with -fno-access-control: a
// step's pieces, and the numbers that are copied between a b2World and the kernel's structs, are
// private to Box2D's classes.
//
// Restates formulas of Box2D 2.3, Copyright (c) 2006-2011 Erin Catto http://www.box2d.org, in code
// of our own, which is not the original software. kernel/lanes.h has the terms.
#pragma once

#include <Box2D/Collision/b2TimeOfImpact.h>
#include <Box2D/Dynamics/b2Island.h>
#include <Box2D/Dynamics/b2TimeStep.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "robots/bipedal_walker/box2d_pinned/swept_vertices.h"
#include "robots/bipedal_walker/physics.h"

namespace walker::bipedal_walker {

static_assert(kMaxContacts <= b2_maxTOIContacts && kMaxContactsOfBody <= b2_maxTOIContacts);

inline int truth(bool is_true) { return is_true ? -1 : 0; }

inline bool is_finite(const BodyState<float>& body) {
  return std::isfinite(body.x) && std::isfinite(body.y) && std::isfinite(body.angle) &&
         std::isfinite(body.velocity_x) && std::isfinite(body.velocity_y) &&
         std::isfinite(body.angular_velocity);
}

inline BodyState<float> state_of(const b2Body& body) {
  return {body.m_sweep.c.x,        body.m_sweep.c.y,        body.m_sweep.a,
          body.m_linearVelocity.x, body.m_linearVelocity.y, body.m_angularVelocity};
}

inline InverseMass<float> inverse_mass_of(const b2Body& body) {
  return {body.m_invMass, body.m_invI};
}

inline void set_state(b2Body& body, const BodyState<float>& state) {
  body.m_sweep.c.Set(state.x, state.y);
  body.m_sweep.a = state.angle;
  body.m_linearVelocity.Set(state.velocity_x, state.velocity_y);
  body.m_angularVelocity = state.angular_velocity;
}

/// Returns Model::dt_ratio, or 0 in a world's first step, which has no preceding one.
inline float dt_ratio_of(const b2World& world, const Model& model) {
  return world.m_inv_dt0 * model.dt;
}

inline b2TimeStep whole_step(const b2World& world, const Model& model) {
  b2TimeStep step;
  step.dt = model.dt;
  step.inv_dt = 1.0F / model.dt;
  step.dtRatio = dt_ratio_of(world, model);
  step.velocityIterations = model.velocity_iterations;
  step.positionIterations = model.position_iterations;
  step.warmStarting = true;
  return step;
}

inline bool is_solid(const b2Contact& contact) {
  return contact.IsEnabled() && contact.IsTouching();
}

inline b2Body& ground_of(const b2Contact& contact) {
  b2Body& body = *contact.m_fixtureA->m_body;
  return body.m_type == b2_staticBody ? body : *contact.m_fixtureB->m_body;
}

inline void read_contact(const b2Contact& contact, const b2Body& walker,
                         ContactManifold<float, int>& read) {
  const b2Manifold& manifold = contact.m_manifold;
  const bool walker_is_a = contact.m_fixtureA->m_body == &walker;
  read.exists = truth(true);
  read.walker_is_a = truth(walker_is_a);
  read.walker_has_face = truth((manifold.type == b2Manifold::e_faceA) == walker_is_a);
  read.has_two_points = truth(manifold.pointCount == 2);
  read.normal_x = manifold.localNormal.x;
  read.normal_y = manifold.localNormal.y;
  read.plane_x = manifold.localPoint.x;
  read.plane_y = manifold.localPoint.y;
  for (int i = 0; i < 2; ++i) {
    const bool exists = i < manifold.pointCount;
    read.point_x[i] = exists ? manifold.points[i].localPoint.x : 0;
    read.point_y[i] = exists ? manifold.points[i].localPoint.y : 0;
  }
  read.friction = contact.m_friction;
}

/// The impacts of one instance's step.
///
/// Between the beginning (alpha = 0) and the end (1) of the step, each body moves along its sweep,
/// linearly in centre and angle. `find` chooses the contact with the earliest time of impact,
///
///   toi = alpha0 + (1 - alpha0) t,   t: b2TimeOfImpact on the rest of the sweep, from alpha0 to 1
///
/// and moves its body there. The kernel solves the impact with all contacts that the body has there
/// (ToiLanes), and moves the body on for (1 - toi) dt. `find` ends when no contact has an impact
/// before 1. A contact that has had more than b2_maxSubSteps impacts is ignored.
///
/// State: sweeps, velocities, and each contact's toi and number of impacts.
/// Source: Box2D (box2d-py 2.3.8), Dynamics/b2World.cpp, b2World::SolveTOI.
class WorldToi {
 public:
  /// Ground already has `alpha0` = 0 and no island flags, from the end of the last step.
  void begin(const WalkerParts& parts, const Model& model) {
    parts_ = parts;
    model_ = &model;
    for (b2Body* body : parts_.bodies) body->m_sweep.alpha0 = 0;
    for (b2Contact* contact = parts_.world->GetContactList(); contact != nullptr;
         contact = contact->m_next) {
      contact->m_flags &= ~(b2Contact::e_toiFlag | b2Contact::e_islandFlag);
      contact->m_toiCount = 0;
      contact->m_toi = 1;
    }
  }

  /// Advances a body to the first remaining impact with the ground; returns whether there is one.
  bool find() {
    for (;;) {
      float alpha = 1;
      b2Contact* const first = find_first(alpha);
      if (first == nullptr || 1.0F - 10.0F * b2_epsilon < alpha) return false;
      if (advance(*first, alpha)) return true;
    }
  }

  ToiIsland& island() { return island_; }

  void finish() {
    b2Body& walker = *parts_.bodies[static_cast<std::size_t>(island_.body)];
    if (num_contacts_ <= kMaxContactsOfBody && is_finite(island_.state)) {
      walker.m_sweep.c0.Set(island_.safe_x, island_.safe_y);
      walker.m_sweep.a0 = island_.safe_angle;
      set_state(walker, island_.state);
      walker.SynchronizeTransform();
    } else {
      solve_by_box2d();
    }
    std::for_each_n(bodies_.begin(), num_bodies_, [](b2Body* body) {
      body->m_flags = static_cast<uint16>(body->m_flags & ~b2Body::e_islandFlag);
    });
    walker.SynchronizeFixtures();
    for (b2ContactEdge* edge = walker.m_contactList; edge != nullptr; edge = edge->next) {
      edge->contact->m_flags &= ~(b2Contact::e_toiFlag | b2Contact::e_islandFlag);
    }
    parts_.world->m_contactManager.FindNewContacts();
  }

 private:
  static bool can_move(const b2Fixture& fixture) {
    return fixture.m_body->IsAwake() && fixture.m_body->m_type != b2_staticBody;
  }

  std::size_t index_of(const b2Body& walker) const {
    const auto& bodies = parts_.bodies;
    return static_cast<std::size_t>(
        std::distance(bodies.begin(), std::find(bodies.begin(), bodies.end(), &walker)));
  }

  /// Returns the contact with the earliest impact before `alpha`, or null, and sets `alpha` to it.
  b2Contact* find_first(float& alpha) {
    b2Contact* first = nullptr;
    for (b2Contact* contact = parts_.world->GetContactList(); contact != nullptr;
         contact = contact->m_next) {
      if (!contact->IsEnabled() || contact->m_toiCount > b2_maxSubSteps) continue;
      if ((contact->m_flags & b2Contact::e_toiFlag) == 0) {
        if (!can_move(*contact->m_fixtureA) && !can_move(*contact->m_fixtureB)) continue;
        contact->m_toi = time_of_impact(*contact);
        contact->m_flags |= b2Contact::e_toiFlag;
      }
      if (contact->m_toi < alpha) {
        first = contact;
        alpha = contact->m_toi;
      }
    }
    return first;
  }

  float time_of_impact(b2Contact& contact) {
    b2Fixture& fixture_a = *contact.m_fixtureA;
    b2Fixture& fixture_b = *contact.m_fixtureB;
    b2Sweep& sweep_a = fixture_a.m_body->m_sweep;
    b2Sweep& sweep_b = fixture_b.m_body->m_sweep;
    // Puts both sweeps onto the same time interval.
    const float alpha0 = b2Max(sweep_a.alpha0, sweep_b.alpha0);
    if (sweep_a.alpha0 < alpha0) sweep_a.Advance(alpha0);
    if (sweep_b.alpha0 < alpha0) sweep_b.Advance(alpha0);
    b2Assert(alpha0 < 1.0F);

    const bool a_is_ground = fixture_a.m_body->m_type == b2_staticBody;
    const b2Body& walker = a_is_ground ? *fixture_b.m_body : *fixture_a.m_body;
    const b2Fixture& ground = a_is_ground ? fixture_a : fixture_b;
    SweptVertices& swept = swept_[index_of(walker)];
    swept.follow(walker);
    if (swept.stay_apart_from(*ground.m_shape)) return 1;

    b2TOIInput input;
    input.proxyA.Set(fixture_a.GetShape(), contact.m_indexA);
    input.proxyB.Set(fixture_b.GetShape(), contact.m_indexB);
    input.sweepA = sweep_a;
    input.sweepB = sweep_b;
    input.tMax = 1;
    b2TOIOutput output;
    b2TimeOfImpact(&output, &input);
    if (output.state != b2TOIOutput::e_touching) return 1;
    return b2Min(alpha0 + (1.0F - alpha0) * output.t, 1.0F);
  }

  /// Moves both bodies to the time of impact.
  /// @return whether they touch there; if not, both are restored and the contact is disabled
  bool advance(b2Contact& contact, float alpha) {
    b2ContactListener* const listener = parts_.world->m_contactManager.m_contactListener;
    b2Body& body_a = *contact.m_fixtureA->m_body;
    b2Body& body_b = *contact.m_fixtureB->m_body;
    const b2Sweep before_a = body_a.m_sweep;
    const b2Sweep before_b = body_b.m_sweep;
    body_a.Advance(alpha);
    body_b.Advance(alpha);
    contact.Update(listener);
    contact.m_flags &= ~b2Contact::e_toiFlag;
    ++contact.m_toiCount;
    if (!is_solid(contact)) {
      contact.SetEnabled(false);
      body_a.m_sweep = before_a;
      body_b.m_sweep = before_b;
      body_a.SynchronizeTransform();
      body_b.SynchronizeTransform();
      return false;
    }
    b2Body& walker = body_a.m_type == b2_staticBody ? body_b : body_a;
    body_a.SetAwake(true);
    body_b.SetAwake(true);
    bodies_[0] = &body_a;
    bodies_[1] = &body_b;
    num_bodies_ = 2;
    for (b2Body* body : {&body_a, &body_b}) body->m_flags |= b2Body::e_islandFlag;
    contact.m_flags |= b2Contact::e_islandFlag;
    contacts_[0] = &contact;
    num_contacts_ = 1;
    gather_contacts(walker, alpha);
    read_island(walker, alpha);
    return true;
  }

  /// Adds the body's other contacts at that time to the island.
  void gather_contacts(b2Body& walker, float alpha) {
    b2ContactListener* const listener = parts_.world->m_contactManager.m_contactListener;
    for (b2ContactEdge* edge = walker.m_contactList; edge != nullptr; edge = edge->next) {
      if (num_contacts_ == b2_maxTOIContacts) break;
      b2Contact& contact = *edge->contact;
      if ((contact.m_flags & b2Contact::e_islandFlag) != 0) continue;
      b2Body& ground = *edge->other;
      const bool is_in_island = (ground.m_flags & b2Body::e_islandFlag) != 0;
      const b2Sweep before = ground.m_sweep;
      if (!is_in_island) ground.Advance(alpha);
      contact.Update(listener);
      if (!is_solid(contact)) {
        ground.m_sweep = before;
        ground.SynchronizeTransform();
        continue;
      }
      contact.m_flags |= b2Contact::e_islandFlag;
      contacts_[static_cast<std::size_t>(num_contacts_++)] = &contact;
      if (is_in_island) continue;
      ground.m_flags |= b2Body::e_islandFlag;
      bodies_[static_cast<std::size_t>(num_bodies_++)] = &ground;
    }
  }

  /// Reads at most the contacts that the kernel supports. If there are more, `finish` uses Box2D.
  void read_island(const b2Body& walker, float alpha) {
    island_.body = static_cast<int>(index_of(walker));
    island_.dt = (1.0F - alpha) * model_->dt;
    island_.state = state_of(walker);
    island_.inverse_mass = inverse_mass_of(walker);
    island_.num_contacts = std::min(num_contacts_, kMaxContactsOfBody);
    island_.pattern = static_cast<unsigned>(num_contacts_);
    for (int i = 0; i < island_.num_contacts; ++i) {
      auto& contact = island_.contacts[static_cast<std::size_t>(i)];
      read_contact(*contacts_[static_cast<std::size_t>(i)], walker, contact);
      island_.pattern = 2 * island_.pattern + (contact.has_two_points != 0 ? 1 : 0);
    }
  }

  void solve_by_box2d() {
    b2World& world = *parts_.world;
    b2Island island(2 * b2_maxTOIContacts, b2_maxTOIContacts, 0, &world.m_stackAllocator,
                    world.m_contactManager.m_contactListener);
    std::for_each_n(bodies_.begin(), num_bodies_, [&](b2Body* body) { island.Add(body); });
    std::for_each_n(contacts_.begin(), num_contacts_,
                    [&](b2Contact* contact) { island.Add(contact); });
    b2TimeStep step = whole_step(world, *model_);
    step.dt = island_.dt;
    step.inv_dt = 1.0F / step.dt;
    step.dtRatio = 1;
    step.positionIterations = 20;
    step.warmStarting = false;
    island.SolveTOI(step, bodies_[0]->m_islandIndex, bodies_[1]->m_islandIndex);
  }

  WalkerParts parts_;
  const Model* model_;
  std::array<SweptVertices, kBodies> swept_;
  ToiIsland island_;
  // Contents of the b2Island of one impact.
  int num_bodies_;
  int num_contacts_;
  std::array<b2Body*, std::size_t{2} * b2_maxTOIContacts> bodies_;
  std::array<b2Contact*, b2_maxTOIContacts> contacts_;
};

}  // namespace walker::bipedal_walker
