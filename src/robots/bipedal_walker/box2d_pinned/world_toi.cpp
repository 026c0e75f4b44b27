// Compiled with -fno-access-control: a step's pieces are private to Box2D's classes.
//
// Restates formulas of Box2D 2.3, Copyright (c) 2006-2011 Erin Catto http://www.box2d.org, in code
// of our own, which is not the original software. kernel/lanes.h has the terms.
#include "robots/bipedal_walker/box2d_pinned/world_toi.h"

#include <Box2D/Collision/b2TimeOfImpact.h>
#include <Box2D/Dynamics/b2Island.h>

#include <algorithm>
#include <cmath>

namespace walker::bipedal_walker {
namespace {

/// Target plus tolerance of b2TimeOfImpact for polygons and edges: nearer shapes touch.
constexpr float kTouching = 1.25F * b2_linearSlop;
static_assert(2 * b2_polygonRadius - 3 * b2_linearSlop < 1.001F * b2_linearSlop);

/// The rounding error of a vertex is at most 1e-4 m for positions and angles below these limits.
/// The margin is ten times that, for the errors made here and in Box2D.
constexpr float kMargin = 1e-3F;
constexpr float kMaxPosition = 500;  // [m]
constexpr float kMaxAngle = 100;     // [rad]

bool is_same(const b2Sweep& a, const b2Sweep& b) {
  return a.c0 == b.c0 && a.c == b.c && a.a0 == b.a0 && a.a == b.a;
}

bool is_near(const b2Vec2& position) {
  return std::abs(position.x) < kMaxPosition && std::abs(position.y) < kMaxPosition;
}

bool is_near(const b2Sweep& sweep) {
  return is_near(sweep.c0) && is_near(sweep.c) && std::abs(sweep.a0) < kMaxAngle &&
         std::abs(sweep.a) < kMaxAngle;
}

struct Range {
  float low, high;
};

Range range_of(const b2Vec2* vertices, int count, const b2Vec2& axis) {
  Range range{b2_maxFloat, -b2_maxFloat};
  for (int i = 0; i < count; ++i) {
    const float position = b2Dot(axis, vertices[i]);
    range = {std::min(range.low, position), std::max(range.high, position)};
  }
  return range;
}

bool can_move(const b2Fixture& fixture) {
  return fixture.m_body->IsAwake() && fixture.m_body->m_type != b2_staticBody;
}

}  // namespace

void SweptVertices::follow(const b2Body& body) {
  if (is_known_ && is_same(sweep_, body.m_sweep)) return;
  sweep_ = body.m_sweep;
  is_known_ = is_near(sweep_);
  if (!is_known_) return;
  b2Transform begin;
  begin.q.Set(sweep_.a0);
  begin.p = sweep_.c0 - b2Mul(begin.q, sweep_.localCenter);
  const auto& shape = static_cast<const b2PolygonShape&>(*body.m_fixtureList->GetShape());
  float farthest = 0;  // squared
  count_ = 0;
  for (int i = 0; i < shape.m_count; ++i) {
    const b2Vec2& vertex = shape.m_vertices[i];
    vertices_[count_++] = b2Mul(begin, vertex);
    vertices_[count_++] = b2Mul(body.m_xf, vertex);
    farthest = std::max(farthest, b2DistanceSquared(vertex, sweep_.localCenter));
  }
  const float turn = sweep_.a - sweep_.a0;
  bulge_ = std::sqrt(farthest) * turn * turn / 8;
}

bool SweptVertices::stay_beyond(const b2Vec2* terrain, int count, const b2Vec2& axis) const {
  const Range theirs = range_of(terrain, count, axis);
  const Range ours = range_of(vertices_.data(), count_, axis);
  const float distance = kTouching + kMargin + bulge_;
  return ours.low > theirs.high + distance || ours.high < theirs.low - distance;
}

bool SweptVertices::stay_apart_from(const b2Shape& terrain) const {
  if (!is_known_) return false;
  const b2Vec2 across(1, 0);
  if (terrain.GetType() == b2Shape::e_edge) {
    const auto& edge = static_cast<const b2EdgeShape&>(terrain);
    const std::array<b2Vec2, 2> ends{edge.m_vertex1, edge.m_vertex2};
    b2Vec2 normal = b2Cross(ends[1] - ends[0], 1.0F);
    normal.Normalize();
    return stay_beyond(ends.data(), 2, normal) || stay_beyond(ends.data(), 2, across);
  }
  if (terrain.GetType() != b2Shape::e_polygon) return false;
  const auto& polygon = static_cast<const b2PolygonShape&>(terrain);
  const b2Vec2 up(0, 1);
  return stay_beyond(polygon.m_vertices, polygon.m_count, up) ||
         stay_beyond(polygon.m_vertices, polygon.m_count, across);
}

/// Terrain already has `alpha0` = 0 and no island flags, from the end of the last step.
void WorldToi::begin(const WalkerParts& parts, const Model& model) {
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

bool WorldToi::find() {
  for (;;) {
    float alpha = 1;
    b2Contact* const first = find_first(alpha);
    if (first == nullptr || 1.0F - 10.0F * b2_epsilon < alpha) return false;
    if (advance(*first, alpha)) return true;
  }
}

std::size_t WorldToi::index_of(const b2Body& walker) const {
  const auto& bodies = parts_.bodies;
  return static_cast<std::size_t>(
      std::distance(bodies.begin(), std::find(bodies.begin(), bodies.end(), &walker)));
}

/// Returns the contact with the earliest impact before `alpha`, or null, and sets `alpha` to it.
b2Contact* WorldToi::find_first(float& alpha) {
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

float WorldToi::time_of_impact(b2Contact& contact) {
  b2Fixture& fixture_a = *contact.m_fixtureA;
  b2Fixture& fixture_b = *contact.m_fixtureB;
  b2Sweep& sweep_a = fixture_a.m_body->m_sweep;
  b2Sweep& sweep_b = fixture_b.m_body->m_sweep;
  // Puts both sweeps onto the same time interval.
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
/// @return whether they touch there; if not, both are restored and the contact is disabled
bool WorldToi::advance(b2Contact& contact, float alpha) {
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
void WorldToi::gather_contacts(b2Body& walker, float alpha) {
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
    bodies_[static_cast<std::size_t>(num_bodies_++)] = &terrain;
  }
}

/// Reads at most the contacts that the kernel supports. If there are more, `finish` uses Box2D.
void WorldToi::read_island(const b2Body& walker, float alpha) {
  island_.body = static_cast<int>(index_of(walker));
  island_.dt = (1.0F - alpha) * model_->dt;
  island_.state = state_of(walker);
  island_.num_contacts = std::min(num_contacts_, kMaxContactsOfBody);
  island_.pattern = static_cast<unsigned>(num_contacts_);
  for (int i = 0; i < island_.num_contacts; ++i) {
    auto& contact = island_.contacts[static_cast<std::size_t>(i)];
    read_contact(*contacts_[static_cast<std::size_t>(i)], walker, contact);
    island_.pattern = 2 * island_.pattern + (contact.has_two_points != 0 ? 1 : 0);
  }
}

void WorldToi::finish() {
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

void WorldToi::solve_by_box2d() {
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

}  // namespace walker::bipedal_walker
