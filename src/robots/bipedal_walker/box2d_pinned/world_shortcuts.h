// Shortcuts in the work of one b2World that keep its bits.
#pragma once

#include <Box2D/Box2D.h>

namespace walker::bipedal_walker {

/// Reserves nodes of the broad phase's tree. The engine would double its capacity repeatedly, write
/// to all of it and fragment the heap.
/// @param fixtures upper bound of the fixtures in the world; at least 1
void reserve_tree_nodes(b2World& world, int fixtures);

/// Clears the buffer of moved proxies, from which the next search for pairs starts. Pairs of
/// terrain are discarded anyway, and pairs with the walker are found from the walker's side.
/// @param world must contain only static bodies
void clear_move_buffer(b2World& world);

/// Ends the world's list of bodies with the walker while this object exists. Box2D's step traverses
/// the whole list several times, although terrain does not move.
class ShortBodyList {
 public:
  /// @param last the oldest body of the walker; all older ones are static
  ShortBodyList(b2World& world, b2Body& last);
  ShortBodyList(const ShortBodyList&) = delete;
  ShortBodyList& operator=(const ShortBodyList&) = delete;
  ~ShortBodyList();

 private:
  b2World& world_;
  b2Body& last_;
  b2Body* rest_;
  int count_;
};

}  // namespace walker::bipedal_walker
