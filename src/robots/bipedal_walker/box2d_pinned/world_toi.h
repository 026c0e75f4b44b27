// The second half of a step of one b2World, b2World::SolveTOI, in pieces:
//
//   begin -> (find -> [solve impact] -> finish)*
//
// Supports the same worlds as world_step.cpp. Only for files compiled with -fno-access-control: the
// numbers that are copied between a b2World and the kernel's structs are private to Box2D's
// classes.
#pragma once

#include <Box2D/Dynamics/b2TimeStep.h>

#include <array>
#include <cmath>
#include <cstddef>

#include <Box2D/Box2D.h>

#include "robots/bipedal_walker/kernel/kernel.h"
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

inline b2Body& terrain_of(const b2Contact& contact) {
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

/// Proves, cheaper than by a time of impact, that a body does not touch terrain within a step.
///
/// Bounds the body's vertices during a sweep by their positions at its beginning and end.
/// A vertex moves along x(t) = c(t) + R(a(t)) r, with centre c and angle a linear in t. Along an
/// axis n of length 1, n c(t) is between its values at both ends. The second derivative of n R(a) r
/// by the angle is at most |r|, so n R(a) r is at most |r| (a1 - a0)^2 / 8 below the chord between
/// its ends:
///
///   n x(t) >= min(n x(0), n x(1)) - |r| (a1 - a0)^2 / 8
///
/// If this bound is beyond the terrain's shape for every vertex, so is the body at all times.
class SweptVertices {
 public:
  /// Computes the vertices, unless the sweep is unchanged. The body must be at its sweep's end.
  void follow(const b2Body& body);

  /// Whether the shapes stay farther apart along one of the tested axes than the distance at which
  /// b2TimeOfImpact reports touching. False if this cannot be proved.
  /// @param terrain an edge or a polygon of a static body at the origin
  bool stay_apart_from(const b2Shape& terrain) const;

 private:
  bool stay_beyond(const b2Vec2* terrain, int count, const b2Vec2& axis) const;

  b2Sweep sweep_{};
  bool is_known_ = false;
  float bulge_ = 0;  // bound of a vertex's distance beyond its positions at both ends [m]
  int count_ = 0;
  std::array<b2Vec2, std::size_t{2} * b2_maxPolygonVertices>
      vertices_;  // at the beginning and at the end [m]
};

class WorldToi {
 public:
  void begin(const WalkerParts& parts, const Model& model);

  /// Advances a body to the first remaining impact with the terrain; returns whether there is one.
  bool find();
  ToiIsland& island() { return island_; }
  void finish();

 private:
  b2Contact* find_first(float& alpha);
  float time_of_impact(b2Contact& contact);
  bool advance(b2Contact& contact, float alpha);
  void gather_contacts(b2Body& walker, float alpha);
  void read_island(const b2Body& walker, float alpha);
  void solve_by_box2d();
  std::size_t index_of(const b2Body& walker) const;

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
