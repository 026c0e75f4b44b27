// Physics of worlds: the parameters of planar robots, and models with their values.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "robots/mujoco/engine.h"
#include "robots/mujoco/model_pool.h"
#include "walker_sim/world.h"

namespace walker::mujoco {

/// A robot's damping in Gymnasium and the most with which its simulation is stable [N m s].
struct DampingLimits {
  double default_value;
  double maximum;
};

/// Parameter of the floor's sliding friction.
constexpr const char* kFloorFriction = "floor_friction";

/// Returns the world's parameters of physics, which all can change within an episode.
/// @param bodies       by MuJoCo's names, on which forces can act and whose masses can be set
/// @param push_impulse default of the impulse of pushes [N s]
std::vector<WorldParameter> physics_parameters(const DampingLimits& damping,
                                               const std::vector<std::string>& bodies,
                                               double push_impulse);

/// Values of a world's parameters of physics, named as these.
struct WorldPhysics {
  std::optional<double> gravity;         ///< empty: the model's own
  std::optional<double> joint_damping;   ///< empty: the model's own
  std::optional<double> floor_friction;  ///< empty: the model's own
  std::map<std::string, double> masses;  ///< of bodies, by name [kg]
  double friction_scale = 1;
  double motor_strength = 1;
  double mass_scale = 1;
  bool has_level = false;  ///< whether a line of ground replaces the floor

  friend bool operator==(const WorldPhysics& a, const WorldPhysics& b);
};

/// @param values other names are ignored
WorldPhysics physics_of(const WorldValues& values);

class MassComputation;

/// Makes the models of one robot's worlds. It keeps the last one, because most episodes have the
/// physics of the one before.
class WorldModels {
 public:
  /// @param base the empty world's model, from `load_planar_model`
  explicit WorldModels(ModelPointer base);

  const ModelPointer& base() const { return base_; }

  /// Returns a model with these values, or the base model if they are its own:
  ///
  ///   gravity         opt.gravity[2]
  ///   floor_friction  geom_friction[0] of the floor, and with it that of pairs with the floor
  ///   friction_scale  times geom_friction and pair_friction
  ///   motor_strength  times actuator_gear
  ///   mass_scale      times body_mass and body_inertia; armatures stay. mj_setConst computes what
  ///                   depends on the masses.
  ///   BODY_mass       body_mass of one body, whatever mass_scale is; nothing else changes, as in
  ///                   RRLS (Zouitine et al. 2024, https://arxiv.org/abs/2406.08406)
  ///   joint_damping   dof_damping of the limbs' hinges
  ///   has_level       raises the floor far above the robot (`GroundInUse`), and gives mjData more
  ///                   room for contacts
  ///
  /// The model shares its other arrays with the base model: it takes a few kB instead of 300, but
  /// MuJoCo must not write, copy or save it.
  /// @throws std::runtime_error if MuJoCo's memory fails
  ModelPointer model_of(const WorldPhysics& physics);

 private:
  ModelPointer base_;
  std::shared_ptr<ModelPool<MassComputation>> mass_computations_;
  WorldPhysics last_physics_;
  ModelPointer last_model_;
};

}  // namespace walker::mujoco
