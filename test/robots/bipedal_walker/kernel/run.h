// Worlds stepped together beside the same worlds stepped by Box2D alone.
#pragma once

#include <string>
#include <vector>

#include "robots/bipedal_walker/kernel/kernel.h"

namespace walker::bipedal_walker {

/// The names of the ways in which walkers are driven and begin again:
///   random     random actions until the hull touches the ground
///   saturated  actions of -1, 0 and 1
///   heuristic  as the heuristic walks, with some noise
///   endless    random actions without an end, on the ground or anywhere
///   rest       no action, without an end: the walker falls, lies and sleeps
///   thrown     now and then a body gets any speed, up to 300 m/s and 300 rad/s
///   far        angles of many turns, bodies far from where they belong
const std::vector<std::string>& modes();

struct RunOptions {
  std::string mode = "random";
  bool hardcore = false;
  bool reuse_world = false;
  long steps = 2500;  ///< of all worlds together, at least
  std::size_t worlds = 64;
};

struct Tally {
  long different = 0;  ///< states that are not Box2D's
  std::string first_different;
};

struct Report {
  long steps = 0;  ///< of each contestant
  long resets = 0;
  long failures = 0;      ///< of Box2D: assertions
  long sleeps = 0;        ///< steps after which a world was asleep
  int most_contacts = 0;  ///< that touch, of one world
  std::vector<Tally> tallies;
};

/// Each contestant steps all worlds, and Box2D does. Where a world differs it begins anew. A step
/// in which Box2D fails an assertion must fail for all.
Report run(const std::vector<const Kernel*>& contestants, const RunOptions& options);

}  // namespace walker::bipedal_walker
