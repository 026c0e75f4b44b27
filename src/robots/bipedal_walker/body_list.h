// The world's list of bodies during a step.
#pragma once

#include "robots/bipedal_walker/box2d.h"

namespace walker::bipedal_walker {

/// Box2D's step goes through the list of all bodies several times, only to find that terrain does
/// not move. While this object lives, the list may end with the walker.
///
/// box2d_any/ leaves the list as it is; box2d_pinned/ shortens it.
class ShortBodyList {
 public:
  /// @param last the oldest body of the walker; all older ones are static
  ShortBodyList(b2World& world, b2Body& last);
  ShortBodyList(const ShortBodyList&) = delete;
  ShortBodyList& operator=(const ShortBodyList&) = delete;
  ~ShortBodyList();  // NOLINT(performance-trivially-destructible): in box2d_any/ alone

 private:
  b2World& world_;
  b2Body& last_;
  b2Body* rest_ = nullptr;
  int count_ = 0;
};

}  // namespace walker::bipedal_walker
