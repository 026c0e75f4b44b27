// Compiled with -fno-access-control: Box2D's tree and buffers are private.
#include "robots/bipedal_walker/broad_phase.h"

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

}  // namespace walker::bipedal_walker
