// Steps worlds by kernels and by Box2D alone, and compares them.
#pragma once

#include <string>
#include <vector>

#include "robots/bipedal_walker/kernel/kernel.h"

namespace walker::bipedal_walker {

/// Names of the modes, which define how walkers are driven and when they are reset:
///   random     random actions until the hull touches the ground
///   saturated  actions of -1, 0 and 1
///   heuristic  the heuristic's actions with some noise
///   endless    random actions for 100 to 900 steps, falls included
///   rest       no action for 100 to 900 steps: the walker falls, lies and sleeps
///   thrown     one step in 20, a body gets a random velocity, up to 300 m/s and 300 rad/s
///   far        one step in 20, a body moves by up to 3 m and gets an angle of up to 40 rad
const std::vector<std::string>& modes();

struct RunOptions {
  std::string mode = "random";
  bool hardcore = false;
  bool reuse_world = false;
  long steps = 2500;  ///< minimum, summed over the worlds
  std::size_t worlds = 64;
};

struct Tally {
  long different = 0;  ///< states that differ from Box2D's
  std::string first_different;
};

struct Report {
  long steps = 0;  ///< per contestant
  long resets = 0;
  long failures = 0;      ///< assertions that failed in Box2D
  long sleeps = 0;        ///< steps after which a world was asleep
  int most_contacts = 0;  ///< maximum of touching contacts in one world
  std::vector<Tally> tallies;
};

/// Steps all worlds by each contestant and by Box2D. A world that differs is reset. If Box2D fails
/// an assertion in a step, all contestants must fail in it.
Report run(const std::vector<const Kernel*>& contestants, const RunOptions& options);

}  // namespace walker::bipedal_walker
