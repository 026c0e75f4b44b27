// Optimisations of the world's broad phase, which finds pairs of nearby shapes.
#pragma once

#include <Box2D/Box2D.h>

namespace walker::bipedal_walker {

/// Reserves tree nodes. The engine would double its capacity repeatedly, write to all of it and
/// fragment the heap.
/// @param fixtures upper bound of the fixtures in the world; at least 1
void reserve_tree_nodes(b2World& world, int fixtures);

/// Clears the buffer of moved proxies, from which the next search for pairs starts. Pairs of
/// terrain are discarded anyway, and pairs with the walker are found from the walker's side.
/// @param world must contain only static bodies
void clear_move_buffer(b2World& world);

}  // namespace walker::bipedal_walker
