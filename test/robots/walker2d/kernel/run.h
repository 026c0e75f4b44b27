// Kernels beside MuJoCo's library, world by world and step by step.
#pragma once

#include <string>
#include <vector>

#include "robots/mujoco/library_physics.h"
#include "robots/mujoco/model.h"
#include "robots/walker2d/kernel/kernel.h"

namespace walker::walker2d {

/// A way to step worlds.
struct Contestant {
  std::string name;
  const Kernel* kernel;
  StepWorlds step;
};

/// Every kernel that this processor can run, with all of its lanes and with one.
std::vector<Contestant> contestants();

/// The names of the ways in which walkers begin, are driven and begin again:
///   random   near the standing pose, random actions, until they fall
///   violent  from any pose at any speed, actions of +-1 and beyond, until they fall
///   endless  the same without an end at a fall
///   rest     at rest or with both legs driven alike, so that zeros and equal numbers stay such
///   tiny     with denormal numbers
///   wild     a new state at each step, up to 14 contacts and 3000 m/s
///   extreme  a new state at each step, up to the speeds that MuJoCo calls bad
///   gait     as the heuristic walks
const std::vector<std::string>& modes();

/// What was seen of a contestant.
struct Tally {
  long different = 0;  ///< states that are not the library's, of those that it answers for
  long flagged = 0;    ///< states that it leaves to the library
  long missed = 0;     ///< states that the library warns of, and the kernel does not flag
  std::string first_different;
};

struct Report {
  long steps = 0;         ///< of each contestant
  int most_contacts = 0;  ///< of the library
  long warnings = 0;      ///< of the library
  std::vector<Tally> tallies;
};

/// Steps each of some worlds, four engine steps at a time, until `steps` are made, by the library
/// and by each contestant; a flagged one goes on from the library's state, as all do where they
/// differ.
Report run(const std::vector<Contestant>& contestants, const std::string& xml_file,
           const std::string& mode, long steps);

}  // namespace walker::walker2d
