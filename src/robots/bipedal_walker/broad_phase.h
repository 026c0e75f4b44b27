// The world's search for pairs of shapes that come near each other.
#pragma once

#include <Box2D/Box2D.h>

namespace walker::bipedal_walker {

/// Makes room for the nodes of so many fixtures: the engine would double its room again and again,
/// write to all of it, and leave holes in the heap.
/// @param fixtures the most that the world will hold at a time; at least 1
void expect_fixtures(b2World& world, int fixtures);

/// Takes all that has been made or moved so far off the list of what the next search starts from:
/// pairs of terrain are dropped anyway, and those with a walker are found from the walker.
/// @param world must hold nothing but static bodies
void skip_terrain(b2World& world);

}  // namespace walker::bipedal_walker
