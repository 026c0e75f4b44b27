// Compiled with -fno-access-control, because most of this state is private.
#include "robots/bipedal_walker/kernel/world_words.h"

#include <cstring>

namespace walker::bipedal_walker {
namespace {

class Words {
 public:
  Words() { words.reserve(kUsual); }

  void add(float value) {
    std::uint32_t word = 0;
    std::memcpy(&word, &value, sizeof word);
    words.push_back(word);
  }
  void add(const b2Vec2& vector) {
    add(vector.x);
    add(vector.y);
  }
  void add_count(std::int64_t count) { words.push_back(static_cast<std::uint32_t>(count)); }

  std::vector<std::uint32_t> words;

 private:
  static constexpr std::size_t kUsual = 12000;
};

void add_body(const b2Body& body, Words& words) {
  const b2Sweep& sweep = body.m_sweep;
  for (const b2Vec2& place :
       {sweep.c0, sweep.c, body.m_xf.p, body.m_linearVelocity, body.m_force}) {
    words.add(place);
  }
  for (const float value : {sweep.a0, sweep.a, sweep.alpha0, body.m_xf.q.s, body.m_xf.q.c,
                            body.m_angularVelocity, body.m_torque, body.m_sleepTime}) {
    words.add(value);
  }
  // Island flags have no meaning outside of a step.
  words.add_count(body.m_flags & ~b2Body::e_islandFlag);
}

void add_joint(const b2RevoluteJoint& joint, Words& words) {
  for (const float value : {joint.m_impulse.x, joint.m_impulse.y, joint.m_impulse.z,
                            joint.m_motorImpulse, joint.m_motorSpeed, joint.m_maxMotorTorque}) {
    words.add(value);
  }
  words.add_count(joint.m_limitState);
}

void add_contact(const b2Contact& contact, Words& words) {
  // The next step clears the island and TOI flags first.
  words.add_count(contact.m_flags & ~(b2Contact::e_islandFlag | b2Contact::e_toiFlag));
  words.add_count(contact.m_fixtureA->m_proxies[contact.m_indexA].proxyId);
  words.add_count(contact.m_fixtureB->m_proxies[contact.m_indexB].proxyId);
  const b2Manifold& manifold = contact.m_manifold;
  words.add_count(manifold.pointCount);
  if (manifold.pointCount == 0) return;
  words.add_count(manifold.type);
  words.add(manifold.localNormal);
  words.add(manifold.localPoint);
  for (int i = 0; i < manifold.pointCount; ++i) {
    const b2ManifoldPoint& point = manifold.points[i];
    words.add(point.localPoint);
    words.add(point.normalImpulse);
    words.add(point.tangentImpulse);
    words.add_count(point.id.key);
  }
}

}  // namespace

std::vector<std::uint32_t> words_of(Physics& physics) {
  Words words;
  const WalkerParts parts = physics.parts();
  const b2World& world = *parts.world;
  words.add_count(world.m_flags);
  words.add(world.m_inv_dt0);
  for (const b2Body* body = world.m_bodyList; body != nullptr; body = body->m_next) {
    add_body(*body, words);
  }
  for (const b2RevoluteJoint* joint : parts.joints) add_joint(*joint, words);
  for (const b2Contact* contact = world.m_contactManager.m_contactList; contact != nullptr;
       contact = contact->m_next) {
    add_contact(*contact, words);
  }
  const b2DynamicTree& tree = world.m_contactManager.m_broadPhase.m_tree;
  for (int i = 0; i < tree.m_nodeCapacity; ++i) {
    const b2TreeNode& node = tree.m_nodes[i];
    words.add_count(node.height);
    if (node.height < 0) continue;
    words.add(node.aabb.lowerBound);
    words.add(node.aabb.upperBound);
    words.add_count(node.parent);
    words.add_count(node.child1);
    words.add_count(node.child2);
  }
  words.add_count(physics.hull_has_touched());
  words.add_count(physics.leg_touches(0));
  words.add_count(physics.leg_touches(1));
  return words.words;
}

}  // namespace walker::bipedal_walker
