// The world's list of bodies during a step.
#pragma once

#include <Box2D/Box2D.h>

namespace walker::bipedal_walker {

/// Box2D's step goes through the list of all bodies several times, only to find that terrain does
/// not move. While this object lives, the list ends with the walker.
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
  b2Body* rest_ = nullptr;
  int count_ = 0;
};

}  // namespace walker::bipedal_walker
