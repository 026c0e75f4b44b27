// Shortcuts in the work of a b2World that keep its bits. Compiled with -fno-access-control: Box2D's
// tree, buffers and lists are private.
#include "robots/bipedal_walker/physics.h"

#include <algorithm>

namespace walker::bipedal_walker {
namespace {

/// Ends the world's list of bodies with the walker while this object exists. Box2D's step traverses
/// the whole list several times, although ground does not move.
class ShortBodyList {
 public:
  /// The step sizes its island by m_bodyCount. Only ground with a contact can join the island.
  /// Contacts with new ground are therefore found here, as the step would do first.
  /// @param last the oldest body of the walker; all older ones are static
  ShortBodyList(b2World& world, b2Body& last)
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
  ShortBodyList(const ShortBodyList&) = delete;
  ShortBodyList& operator=(const ShortBodyList&) = delete;

  /// Box2D's step resets alpha0 of every body in the list, which does not include the ground. Only
  /// ground with a contact can have an alpha0 other than 0.
  ~ShortBodyList() {
    last_.m_next = rest_;
    world_.m_bodyCount = count_;
    for (const b2Contact* contact = world_.GetContactList(); contact != nullptr;
         contact = contact->m_next) {
      for (b2Fixture* fixture : {contact->m_fixtureA, contact->m_fixtureB}) {
        if (fixture->m_body->m_type == b2_staticBody) fixture->m_body->m_sweep.alpha0 = 0;
      }
    }
  }

 private:
  b2World& world_;
  b2Body& last_;
  b2Body* rest_;
  int count_;
};

}  // namespace

void Physics::step() {
  const ShortBodyList walker_only(world_, *hull_);
  world_.Step(static_cast<float>(1.0 / kStepsPerSecond), kVelocityIterations, kPositionIterations);
}

/// Reserves nodes of the broad phase's tree. The engine would double its capacity repeatedly, write
/// to all of it and fragment the heap. The new nodes are appended to the free list. As after the
/// engine's own growth, they are used in ascending order once the other nodes are used up. The
/// order of nodes affects the engine's bits.
/// @param fixtures upper bound of the fixtures in the world; at least 1
void Physics::reserve_tree_nodes(int fixtures) {
  b2DynamicTree& tree = world_.m_contactManager.m_broadPhase.m_tree;
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

/// Clears the buffer of moved proxies, from which the next search for pairs starts. Pairs of
/// ground are discarded anyway, and pairs with the walker are found from the walker's side.
void Physics::clear_move_buffer() { world_.m_contactManager.m_broadPhase.m_moveCount = 0; }

}  // namespace walker::bipedal_walker
