// The floor of a model, which a level's line replaces.
#pragma once

#include <string>
#include <vector>

#include "robots/mujoco/engine.h"
#include "robots/mujoco/ground_line.h"

namespace walker::mujoco {

/// Returns the geom that a level replaces: the first plane of the world's body with an upward
/// normal; -1: the model has none.
int floor_of(const mjModel& model);

/// Returns the geoms that touch the floor, in ascending order.
/// @param model of `load_planar_model`
std::vector<int> geoms_on_floor(const mjModel& model);

/// Returns why a level cannot replace the model's floor; empty: it can.
/// @param model of `load_planar_model`
std::string level_refusal(const mjModel& model);

/// The refusal for `shared_by_users_of`, because the engine is asked for it.
struct LevelRefusal {
  explicit LevelRefusal(const ModelPointer& model) : text(level_refusal(*model)) {}
  std::string text;
};

/// Replaces the functions of planes with spheres and capsules in MuJoCo's table of collision
/// functions. They do nothing else than the former ones without a `GroundInUse`.
/// @pre no other thread uses MuJoCo, or the functions are installed
void install_ground_contacts();

/// While it exists, spheres and capsules touch the line where this thread's calls of MuJoCo would
/// let them touch the floor's plane. The model's floor must be above them
/// (`WorldModels`), because MuJoCo does not test limbs that are far above it.
class GroundInUse {
 public:
  /// @param line null: the floor is flat
  explicit GroundInUse(const GroundLine* line);
  GroundInUse(const GroundInUse&) = delete;
  GroundInUse& operator=(const GroundInUse&) = delete;
  ~GroundInUse();

 private:
  const GroundLine* before_;
};

}  // namespace walker::mujoco
