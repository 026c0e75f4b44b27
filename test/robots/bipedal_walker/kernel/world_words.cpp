// Compiled with -fno-access-control, because most of this state is private.
#include "robots/bipedal_walker/twin.h"

#include <cstring>
#include <type_traits>

namespace walker::bipedal_walker {
namespace {

class Words {
 public:
  Words() { words.reserve(12000); }  // more than a world has

  /// Appends the bytes of numbers, or of structs without padding.
  template <typename... Values>
  void add(const Values&... values) {
    (add_one(values), ...);
  }

  std::vector<std::uint32_t> words;

 private:
  template <typename Value>
  void add_one(const Value& value) {
    constexpr std::size_t kWordBytes = sizeof(std::uint32_t);
    static_assert(std::is_trivially_copyable_v<Value> && sizeof(Value) % kWordBytes == 0);
    const std::size_t size = words.size();
    words.resize(size + sizeof(Value) / kWordBytes);
    std::memcpy(&words[size], &value, sizeof value);
  }
};

void add_contact(const b2Contact& contact, Words& words) {
  // The next step clears the island and TOI flags first.
  const b2Manifold& manifold = contact.m_manifold;
  words.add(contact.m_flags & ~(b2Contact::e_islandFlag | b2Contact::e_toiFlag),
            contact.m_fixtureA->m_proxies[contact.m_indexA].proxyId,
            contact.m_fixtureB->m_proxies[contact.m_indexB].proxyId, manifold.pointCount);
  if (manifold.pointCount == 0) return;
  words.add(manifold.type, manifold.localNormal, manifold.localPoint);
  for (int i = 0; i < manifold.pointCount; ++i) words.add(manifold.points[i]);
}

}  // namespace

std::vector<std::uint32_t> words_of(Physics& physics) {
  Words words;
  const WalkerParts parts = physics.parts();
  const b2World& world = *parts.world;
  words.add(world.m_flags, world.m_inv_dt0);
  for (const b2Body* body = world.m_bodyList; body != nullptr; body = body->m_next) {
    // Island flags have no meaning outside of a step.
    words.add(body->m_sweep, body->m_xf, body->m_linearVelocity, body->m_angularVelocity,
              body->m_force, body->m_torque, body->m_sleepTime,
              body->m_flags & ~b2Body::e_islandFlag);
  }
  for (const b2RevoluteJoint* joint : parts.joints) {
    words.add(joint->m_impulse, joint->m_motorImpulse, joint->m_motorSpeed, joint->m_maxMotorTorque,
              joint->m_limitState);
  }
  for (const b2Contact* contact = world.m_contactManager.m_contactList; contact != nullptr;
       contact = contact->m_next) {
    add_contact(*contact, words);
  }
  const b2DynamicTree& tree = world.m_contactManager.m_broadPhase.m_tree;
  for (int i = 0; i < tree.m_nodeCapacity; ++i) {
    const b2TreeNode& node = tree.m_nodes[i];
    words.add(node.height);
    if (node.height >= 0) words.add(node.aabb, node.parent, node.child1, node.child2);
  }
  words.add(int{physics.hull_has_touched()}, int{physics.leg_touches(0)},
            int{physics.leg_touches(1)});
  return words.words;
}

std::array<float, kBodies> torques_on(Physics& physics) {
  constexpr std::array<std::size_t, kBodies> kOrder{2, 3, 4, 1, 0};
  std::array<float, kBodies> torques{};
  for (std::size_t i = 0; i < kBodies; ++i) {
    torques[i] = physics.parts().bodies[kOrder[i]]->m_torque;
  }
  return torques;
}

}  // namespace walker::bipedal_walker
