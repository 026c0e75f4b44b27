// The one door to Box2D: 2.3 (pinned, or Ubuntu 20.04's) or 2.4 (Debian 12's).
#pragma once

#if __has_include(<Box2D/Box2D.h>)
#include <Box2D/Box2D.h>
#else
#include <box2d/box2d.h>
#endif

namespace walker::bipedal_walker {

/// An edge that collides from both sides, without neighbours.
inline void set_edge(b2EdgeShape& edge, const b2Vec2& from, const b2Vec2& to) {
#if __has_include(<Box2D/Box2D.h>)
  edge.Set(from, to);
#else
  edge.SetTwoSided(from, to);
#endif
}

}  // namespace walker::bipedal_walker
