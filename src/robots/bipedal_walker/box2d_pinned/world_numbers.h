// Copies numbers between a b2World and the kernel's structs. Only for files compiled with
// -fno-access-control: the numbers are private to Box2D's classes.
#pragma once

#include <Box2D/Dynamics/b2TimeStep.h>

#include <cmath>
#include <cstddef>

#include <Box2D/Box2D.h>

#include "robots/bipedal_walker/kernel/kernel.h"

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

}  // namespace walker::bipedal_walker
