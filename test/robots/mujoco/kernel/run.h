// Compares kernels with MuJoCo's library, instance by instance and step by step.
#pragma once

#include <string>
#include <vector>

#include "robots/mujoco/kernel/kernel_physics.h"
#include "robots/mujoco/model.h"
#include "robots/mujoco/physics.h"

namespace walker::mujoco::kernel {

/// A robot that has kernels.
struct TestedRobot {
  std::string name;  ///< in ids
  const Kernels& kernels;
  double lowest;         ///< a lower trunk has fallen [m]
  double largest_pitch;  ///< so has a trunk with a larger one, in either direction [rad]
  bool limbs_can_touch;  ///< each other
};

/// Returns Hopper and Walker2d.
const std::vector<TestedRobot>& robots();

/// @param xml_file a robot's, such as hopper_v5.xml
const TestedRobot& robot_of(const std::string& xml_file);

struct Contestant {
  std::string name;
  const Kernel* kernel;
  StepInstances step;
};

/// Returns two contestants per supported kernel: with all of its lanes, and with one.
std::vector<Contestant> contestants(const TestedRobot& robot);

/// Names of the modes, which define how walkers start, are driven and are reset:
///   random   near the standing pose, random controls, until a fall
///   violent  joints off by up to 0.5 rad, speeds up to 10, controls up to +-1.5, until a fall
///   endless  like violent, but not reset at a fall
///   rest     from rest, undriven or both legs driven alike; zeros and equal numbers persist
///   tiny     like rest, from denormal offsets and velocities
///   wild     a new state at each step, up to 14 contacts and 3000 m/s
///   extreme  a new state at each step, with speeds up to those that MuJoCo rejects
///   gait     near the standing pose, driven by the heuristic with some noise, until a fall
const std::vector<std::string>& modes();

struct Tally {
  long different = 0;  ///< unflagged states that differ from the library's
  long flagged = 0;    ///< states that the kernel leaves to the library
  long missed = 0;     ///< unflagged states for which the library warned
  std::string first_different;
};

struct Report {
  long steps = 0;                     ///< per contestant
  int most_contacts = 0;              ///< maximum in the library
  long warnings = 0;                  ///< steps after which the library had warned
  long steps_with_limb_contacts = 0;  ///< in which limbs touched each other
  std::vector<Tally> tallies;
};

/// Physics of the instances in a run.
enum class Instances {
  plain,      ///< the model's
  altered,    ///< drawn at each start, some at the parameters' limits; pushes in some steps
  in_levels,  ///< of the model, on a level that is drawn at each start, or on the floor
};

/// Steps 61 instances by the library and by each contestant, four engine steps at a time, until
/// each has made `steps` steps in total. An instance that is flagged or differs continues from the
/// library's state.
Report run(const std::vector<Contestant>& contestants, const std::string& xml_file,
           const std::string& mode, Instances instances, long steps);

}  // namespace walker::mujoco::kernel
