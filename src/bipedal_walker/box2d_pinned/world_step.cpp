// Compiled with -fno-access-control: a step's pieces are private to Box2D's classes.
#include "bipedal_walker/box2d_pinned/world_step.h"

#include <Box2D/Collision/b2TimeOfImpact.h>
#include <Box2D/Dynamics/b2Island.h>

#include <algorithm>
#include <cmath>

#include "bipedal_walker/constants.h"

namespace walker::bipedal_walker {
namespace {

int truth(bool is_true) { return is_true ? -1 : 0; }

bool is_finite(const BodyState<float>& body) {
  return std::isfinite(body.x) && std::isfinite(body.y) && std::isfinite(body.angle) &&
         std::isfinite(body.velocity_x) && std::isfinite(body.velocity_y) &&
         std::isfinite(body.angular_velocity);
}

BodyState<float> state_of(const b2Body& body) {
  return {body.m_sweep.c.x,        body.m_sweep.c.y,        body.m_sweep.a,
          body.m_linearVelocity.x, body.m_linearVelocity.y, body.m_angularVelocity};
}

void set_state(b2Body& body, const BodyState<float>& state) {
  body.m_sweep.c.Set(state.x, state.y);
  body.m_sweep.a = state.angle;
  body.m_linearVelocity.Set(state.velocity_x, state.velocity_y);
  body.m_angularVelocity = state.angular_velocity;
}

b2Transform transform_of(const Rotation<float>& rotation, const b2Vec2& center,
                         const b2Body& body) {
  b2Transform transform;
  transform.q.s = rotation.sine;
  transform.q.c = rotation.cosine;
  transform.p = center - b2Mul(transform.q, body.m_sweep.localCenter);
  return transform;
}

/// As the model has it, but for a world's first step, before which there was none.
float dt_ratio_of(const b2World& world, const Model& model) { return world.m_inv_dt0 * model.dt; }

b2TimeStep whole_step(const b2World& world, const Model& model) {
  b2TimeStep step;
  step.dt = model.dt;
  step.inv_dt = 1.0F / model.dt;
  step.dtRatio = dt_ratio_of(world, model);
  step.velocityIterations = model.velocity_iterations;
  step.positionIterations = model.position_iterations;
  step.warmStarting = true;
  return step;
}

bool is_solid(const b2Contact& contact) { return contact.IsEnabled() && contact.IsTouching(); }

b2Body& terrain_of(const b2Contact& contact) {
  b2Body& body = *contact.m_fixtureA->m_body;
  return body.m_type == b2_staticBody ? body : *contact.m_fixtureB->m_body;
}

}  // namespace

Model model_of(const WalkerParts& parts) {
  Model model{};
  for (std::size_t i = 0; i < kBodies; ++i) {
    const b2Body& body = *parts.bodies[i];
    const b2Vec2& center = body.m_sweep.localCenter;
    model.bodies[i] = {body.m_invMass, body.m_invI, center.x, center.y};
  }
  for (std::size_t i = 0; i < kJoints; ++i) {
    const b2RevoluteJoint& joint = *parts.joints[i];
    const b2Vec2 arm_a = joint.m_localAnchorA - joint.m_bodyA->m_sweep.localCenter;
    const b2Vec2 arm_b = joint.m_localAnchorB - joint.m_bodyB->m_sweep.localCenter;
    model.joints[i] = {arm_a.x, arm_a.y, arm_b.x, arm_b.y, joint.m_referenceAngle,
                       joint.m_lowerAngle, joint.m_upperAngle};
  }
  model.gravity_x = parts.world->m_gravity.x;
  model.gravity_y = parts.world->m_gravity.y;
  model.dt = static_cast<float>(1.0 / kStepsPerSecond);
  model.dt_ratio = 1.0F / model.dt * model.dt;
  model.velocity_iterations = kVelocityIterations;
  model.position_iterations = kPositionIterations;
  return model;
}

void WorldStep::start(const WalkerParts& parts, const Model& model) {
  parts_ = parts;
  model_ = &model;
}

bool WorldStep::begin() {
  b2World& world = *parts_.world;
  if ((world.m_flags & b2World::e_newFixture) != 0) {
    world.m_contactManager.FindNewContacts();
    world.m_flags &= ~b2World::e_newFixture;
  }
  world.m_flags |= b2World::e_locked;
  world.m_contactManager.Collide();
  if (read_island()) return true;
  solve_by_box2d();
  begin_impacts();
  return false;
}

/// @return whether the kernel can take it
bool WorldStep::read_island() {
  if (dt_ratio_of(*parts_.world, *model_) != model_->dt_ratio) return false;
  unsigned pattern = 0;
  num_contacts_ = 0;
  for (std::size_t i = 0; i < kBodies; ++i) {
    const b2Body& body = *parts_.bodies[i];
    if (!body.IsAwake()) return false;
    island_.bodies[i] = state_of(body);
    island_.forces[i] = {body.m_force.x, body.m_force.y, body.m_torque};
    const int first = num_contacts_;
    for (const b2ContactEdge* edge = body.m_contactList; edge != nullptr; edge = edge->next) {
      b2Contact& contact = *edge->contact;
      if (!is_solid(contact)) continue;
      if (num_contacts_ == kMostContacts || num_contacts_ - first == kMostContactsOfBody) {
        return false;
      }
      Contact<float, int>& read = island_.contacts[static_cast<std::size_t>(num_contacts_)];
      read_contact(contact, body, read.manifold);
      for (int k = 0; k < contact.m_manifold.pointCount; ++k) {
        read.impulses.normal[k] = contact.m_manifold.points[k].normalImpulse;
        read.impulses.tangent[k] = contact.m_manifold.points[k].tangentImpulse;
      }
      contacts_[static_cast<std::size_t>(num_contacts_++)] = &contact;
      pattern = 2 * pattern + (contact.m_manifold.pointCount == 2 ? 1 : 0);
    }
    island_.num_contacts[i] = num_contacts_ - first;
    pattern += static_cast<unsigned>(num_contacts_ - first) << (6 + 5 * i);
  }
  pattern *= 16;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const b2RevoluteJoint& joint = *parts_.joints[i];
    const bool at_lower = joint.m_limitState == e_atLowerLimit;
    const bool at_upper = joint.m_limitState == e_atUpperLimit;
    island_.joints[i] = {joint.m_motorSpeed, joint.m_maxMotorTorque, joint.m_impulse.x,
                         joint.m_impulse.y,  joint.m_impulse.z,      joint.m_motorImpulse,
                         truth(at_lower),    truth(at_upper)};
    pattern += at_lower || at_upper ? 1U << i : 0;
  }
  island_.pattern = pattern;
  return true;
}

void WorldStep::read_contact(const b2Contact& contact, const b2Body& walker,
                             ContactManifold<float, int>& read) const {
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

/// The rest of a step before its impacts.
void WorldStep::solve_by_box2d() { parts_.world->Solve(whole_step(*parts_.world, *model_)); }

void WorldStep::finish_island() {
  if (!std::all_of(island_.bodies.begin(), island_.bodies.end(), is_finite)) {
    solve_by_box2d();
    begin_impacts();
    return;
  }
  write_impulses();
  write_bodies();
  fall_asleep();
  synchronize();
  parts_.world->m_contactManager.FindNewContacts();
  begin_impacts();
}

void WorldStep::write_impulses() {
  for (int i = 0; i < num_contacts_; ++i) {
    b2Manifold& manifold = contacts_[static_cast<std::size_t>(i)]->m_manifold;
    const ContactImpulses<float>& impulses =
        island_.contacts[static_cast<std::size_t>(i)].impulses;
    for (int k = 0; k < manifold.pointCount; ++k) {
      manifold.points[k].normalImpulse = impulses.normal[k];
      manifold.points[k].tangentImpulse = impulses.tangent[k];
    }
  }
  for (std::size_t i = 0; i < kJoints; ++i) {
    b2RevoluteJoint& joint = *parts_.joints[i];
    const JointState<float, int>& state = island_.joints[i];
    joint.m_impulse.Set(state.impulse_x, state.impulse_y, state.limit_impulse);
    joint.m_motorImpulse = state.motor_impulse;
    joint.m_limitState = state.at_lower != 0   ? e_atLowerLimit
                         : state.at_upper != 0 ? e_atUpperLimit
                                               : e_inactiveLimit;
  }
}

void WorldStep::write_bodies() {
  for (std::size_t i = 0; i < kBodies; ++i) {
    b2Body& body = *parts_.bodies[i];
    body.m_sweep.c0 = body.m_sweep.c;
    body.m_sweep.a0 = body.m_sweep.a;
    set_state(body, island_.bodies[i]);
    body.m_xf = transform_of(island_.rotations[i], body.m_sweep.c, body);
  }
}

/// The end of b2Island::Solve.
void WorldStep::fall_asleep() {
  if (!parts_.world->m_allowSleep) return;
  float shortest = b2_maxFloat;
  for (b2Body* body : parts_.bodies) {
    const bool moves =
        (body->m_flags & b2Body::e_autoSleepFlag) == 0 ||
        body->m_angularVelocity * body->m_angularVelocity >
            b2_angularSleepTolerance * b2_angularSleepTolerance ||
        b2Dot(body->m_linearVelocity, body->m_linearVelocity) >
            b2_linearSleepTolerance * b2_linearSleepTolerance;
    body->m_sleepTime = moves ? 0 : body->m_sleepTime + model_->dt;
    shortest = b2Min(shortest, body->m_sleepTime);
  }
  if (shortest < b2_timeToSleep || island_.position_is_solved == 0) return;
  for (b2Body* body : parts_.bodies) body->SetAwake(false);
}

/// In the order of the world's list of bodies, which decides how the tree of fixtures grows.
void WorldStep::synchronize() {
  constexpr std::array<std::size_t, kBodies> kOrder{0, 1, 4, 3, 2};  // the newest body first
  b2BroadPhase& broad_phase = parts_.world->m_contactManager.m_broadPhase;
  for (const std::size_t i : kOrder) {
    b2Body& body = *parts_.bodies[i];
    const b2Transform before =
        transform_of(island_.rotations_before[i], body.m_sweep.c0, body);
    for (b2Fixture* fixture = body.m_fixtureList; fixture != nullptr; fixture = fixture->m_next) {
      fixture->Synchronize(&broad_phase, before, body.m_xf);
    }
  }
}

void WorldStep::begin_impacts() {
  for (b2Body* body : parts_.bodies) body->m_sweep.alpha0 = 0;
  for (b2Contact* contact = parts_.world->GetContactList(); contact != nullptr;
       contact = contact->m_next) {
    contact->m_flags &= ~(b2Contact::e_toiFlag | b2Contact::e_islandFlag);
    contact->m_toiCount = 0;
    contact->m_toi = 1;
  }
}

bool WorldStep::find_impact() {
  for (;;) {
    float alpha = 1;
    b2Contact* const first = find_first_impact(alpha);
    if (first == nullptr || 1.0F - 10.0F * b2_epsilon < alpha) return false;
    if (advance(*first, alpha)) return true;
  }
}

std::size_t WorldStep::index_of(const b2Body& walker) const {
  const auto found = std::find(parts_.bodies.begin(), parts_.bodies.end(), &walker);
  return static_cast<std::size_t>(found - parts_.bodies.begin());
}

/// The contact that comes first, and when, as a part of the step.
b2Contact* WorldStep::find_first_impact(float& alpha) {
  b2Contact* first = nullptr;
  for (b2Contact* contact = parts_.world->GetContactList(); contact != nullptr;
       contact = contact->m_next) {
    if (!contact->IsEnabled() || contact->m_toiCount > b2_maxSubSteps) continue;
    if ((contact->m_flags & b2Contact::e_toiFlag) == 0) {
      if (!contact->m_fixtureA->m_body->IsAwake() || contact->m_fixtureA->m_body->m_type == b2_staticBody) {
        if (!contact->m_fixtureB->m_body->IsAwake() || contact->m_fixtureB->m_body->m_type == b2_staticBody) continue;
      }
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

float WorldStep::time_of_impact(b2Contact& contact) {
  b2Fixture& fixture_a = *contact.m_fixtureA;
  b2Fixture& fixture_b = *contact.m_fixtureB;
  b2Sweep& sweep_a = fixture_a.m_body->m_sweep;
  b2Sweep& sweep_b = fixture_b.m_body->m_sweep;
  // Onto the same interval of time.
  const float alpha0 = b2Max(sweep_a.alpha0, sweep_b.alpha0);
  if (sweep_a.alpha0 < alpha0) sweep_a.Advance(alpha0);
  if (sweep_b.alpha0 < alpha0) sweep_b.Advance(alpha0);
  b2Assert(alpha0 < 1.0F);

  const bool a_is_terrain = fixture_a.m_body->m_type == b2_staticBody;
  const b2Body& walker = a_is_terrain ? *fixture_b.m_body : *fixture_a.m_body;
  const b2Fixture& terrain = a_is_terrain ? fixture_a : fixture_b;
  SweptVertices& swept = swept_[index_of(walker)];
  swept.follow(walker);
  if (swept.stay_apart_from(*terrain.m_shape)) return 1;

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
/// @return whether they touch there; else they are back, and the contact does not come again
bool WorldStep::advance(b2Contact& contact, float alpha) {
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
  impact_bodies_[0] = &body_a;
  impact_bodies_[1] = &body_b;
  num_impact_bodies_ = 2;
  for (b2Body* body : {&body_a, &body_b}) body->m_flags |= b2Body::e_islandFlag;
  contact.m_flags |= b2Contact::e_islandFlag;
  contacts_[0] = &contact;
  num_contacts_ = 1;
  gather_contacts(walker, alpha);

  impact_.body = static_cast<int>(index_of(walker));
  impact_.dt = (1.0F - alpha) * model_->dt;
  impact_.state = state_of(walker);
  impact_.num_contacts = std::min(num_contacts_, kMostContactsOfBody);
  impact_.pattern = static_cast<unsigned>(num_contacts_);
  for (int i = 0; i < impact_.num_contacts; ++i) {
    const auto place = static_cast<std::size_t>(i);
    read_contact(*contacts_[place], walker, impact_.contacts[place]);
    impact_.pattern = 2 * impact_.pattern + (impact_.contacts[place].has_two_points != 0 ? 1 : 0);
  }
  return true;
}

/// What else the body touches at that time.
void WorldStep::gather_contacts(b2Body& walker, float alpha) {
  b2ContactListener* const listener = parts_.world->m_contactManager.m_contactListener;
  for (b2ContactEdge* edge = walker.m_contactList; edge != nullptr; edge = edge->next) {
    if (num_contacts_ == b2_maxTOIContacts) break;
    b2Contact& contact = *edge->contact;
    if ((contact.m_flags & b2Contact::e_islandFlag) != 0) continue;
    b2Body& terrain = *edge->other;
    const bool is_in_island = (terrain.m_flags & b2Body::e_islandFlag) != 0;
    const b2Sweep before = terrain.m_sweep;
    if (!is_in_island) terrain.Advance(alpha);
    contact.Update(listener);
    if (!is_solid(contact)) {
      terrain.m_sweep = before;
      terrain.SynchronizeTransform();
      continue;
    }
    contact.m_flags |= b2Contact::e_islandFlag;
    contacts_[static_cast<std::size_t>(num_contacts_++)] = &contact;
    if (is_in_island) continue;
    terrain.m_flags |= b2Body::e_islandFlag;
    impact_bodies_[static_cast<std::size_t>(num_impact_bodies_++)] = &terrain;
  }
}

void WorldStep::finish_impact() {
  b2Body& walker = *parts_.bodies[static_cast<std::size_t>(impact_.body)];
  b2World& world = *parts_.world;
  if (num_contacts_ <= kMostContactsOfBody && is_finite(impact_.state)) {
    walker.m_sweep.c0.Set(impact_.safe_x, impact_.safe_y);
    walker.m_sweep.a0 = impact_.safe_angle;
    set_state(walker, impact_.state);
    walker.SynchronizeTransform();
  } else {
    b2Island island(2 * b2_maxTOIContacts, b2_maxTOIContacts, 0, &world.m_stackAllocator,
                    world.m_contactManager.m_contactListener);
    for (int i = 0; i < num_impact_bodies_; ++i) {
      island.Add(impact_bodies_[static_cast<std::size_t>(i)]);
    }
    for (int i = 0; i < num_contacts_; ++i) island.Add(contacts_[static_cast<std::size_t>(i)]);
    b2TimeStep step = whole_step(world, *model_);
    step.dt = impact_.dt;
    step.inv_dt = 1.0F / step.dt;
    step.dtRatio = 1;
    step.positionIterations = 20;
    step.warmStarting = false;
    island.SolveTOI(step, impact_bodies_[0]->m_islandIndex, impact_bodies_[1]->m_islandIndex);
  }
  for (int i = 0; i < num_impact_bodies_; ++i) {
    impact_bodies_[static_cast<std::size_t>(i)]->m_flags &= ~b2Body::e_islandFlag;
  }
  walker.SynchronizeFixtures();
  for (b2ContactEdge* edge = walker.m_contactList; edge != nullptr; edge = edge->next) {
    edge->contact->m_flags &= ~(b2Contact::e_toiFlag | b2Contact::e_islandFlag);
  }
  world.m_contactManager.FindNewContacts();
}

void WorldStep::end() {
  b2World& world = *parts_.world;
  world.m_inv_dt0 = 1.0F / model_->dt;
  if ((world.m_flags & b2World::e_clearForces) != 0) {
    for (b2Body* body : parts_.bodies) {
      body->m_force.SetZero();
      body->m_torque = 0;
    }
  }
  // As the next step's beginning would; what has no contact has kept it.
  for (b2Contact* contact = world.GetContactList(); contact != nullptr;
       contact = contact->m_next) {
    terrain_of(*contact).m_sweep.alpha0 = 0;
  }
  world.m_flags &= ~b2World::e_locked;
}

}  // namespace walker::bipedal_walker
