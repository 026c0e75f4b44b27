// The one door to Box2D: 2.3 (pinned, or Ubuntu 20.04's) or 2.4 (Debian 12's), by one macro.
#pragma once

#ifdef WALKER_SIM_BOX2D_2_4
#include <box2d/box2d.h>
#else
#include <Box2D/Box2D.h>
#endif

namespace walker::bipedal_walker {

/// An edge that collides from both sides, without neighbours.
inline void set_edge(b2EdgeShape& edge, const b2Vec2& from, const b2Vec2& to) {
#ifdef WALKER_SIM_BOX2D_2_4
  edge.SetTwoSided(from, to);
#else
  edge.Set(from, to);
#endif
}

}  // namespace walker::bipedal_walker
