// Compiled with -fno-access-control: Box2D's tree, buffers and lists are private.
#include "robots/bipedal_walker/box2d_pinned/world_shortcuts.h"

#include <algorithm>

namespace walker::bipedal_walker {

/// Appends the new nodes to the free list. As after the engine's own growth, they are used in
/// ascending order once the other nodes are used up. The order of nodes affects the engine's bits.
void reserve_tree_nodes(b2World& world, int fixtures) {
  b2DynamicTree& tree = world.m_contactManager.m_broadPhase.m_tree;
  const int32 old_capacity = tree.m_nodeCapacity;
  const int32 capacity = 2 * fixtures - 1;  // a binary tree with a fixture in each leaf
  if (capacity <= old_capacity) return;
  auto* nodes =
      static_cast<b2TreeNode*>(b2Alloc(capacity * static_cast<int32>(sizeof(b2TreeNode))));
  std::copy_n(tree.m_nodes, old_capacity, nodes);
  for (int32 i = old_capacity; i < capacity; ++i) {
    nodes[i].next = i + 1;
    nodes[i].height = -1;
  }
  nodes[capacity - 1].next = b2_nullNode;
  int32* end = &tree.m_freeList;
  while (*end != b2_nullNode) end = &nodes[*end].next;
  *end = old_capacity;
  b2Free(tree.m_nodes);
  tree.m_nodes = nodes;
  tree.m_nodeCapacity = capacity;
}

void clear_move_buffer(b2World& world) { world.m_contactManager.m_broadPhase.m_moveCount = 0; }

/// The step sizes its island by m_bodyCount. Only terrain with a contact can join the island.
/// Contacts with new terrain are therefore found here, as the step would do first.
ShortBodyList::ShortBodyList(b2World& world, b2Body& last)
    : world_(world), last_(last), rest_(last.m_next), count_(world.m_bodyCount) {
  if ((world_.m_flags & b2World::e_newFixture) != 0) {
    world_.m_contactManager.FindNewContacts();
    world_.m_flags &= ~b2World::e_newFixture;
  }
  last_.m_next = nullptr;
  world_.m_bodyCount = world_.m_contactManager.m_contactCount;
  for (const b2Body* body = world_.m_bodyList; body != nullptr; body = body->m_next) {
    ++world_.m_bodyCount;
  }
}

/// Box2D's step resets alpha0 of every body in the list, which does not include the terrain. Only
/// terrain with a contact can have an alpha0 other than 0.
ShortBodyList::~ShortBodyList() {
  last_.m_next = rest_;
  world_.m_bodyCount = count_;
  for (const b2Contact* contact = world_.GetContactList(); contact != nullptr;
       contact = contact->m_next) {
    for (b2Fixture* fixture : {contact->m_fixtureA, contact->m_fixtureB}) {
      if (fixture->m_body->m_type == b2_staticBody) fixture->m_body->m_sweep.alpha0 = 0;
    }
  }
}

}  // namespace walker::bipedal_walker
