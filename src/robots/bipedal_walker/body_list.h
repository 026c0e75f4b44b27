// Shortens a world's list of bodies during a step.
#pragma once

#include <Box2D/Box2D.h>

namespace walker::bipedal_walker {

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
  b2Body* rest_ = nullptr;
  int count_ = 0;
};

}  // namespace walker::bipedal_walker
