// Physics that tests can inspect: a copy of an environment's, and all state of a world.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "robots/bipedal_walker/physics.h"
#include "robots/bipedal_walker/specification.h"
#include "robots/bipedal_walker/world_settings.h"

namespace walker::bipedal_walker {

/// Steps through the same states as a BipedalWalker after `reset(seed)` with the same actions.
class Twin {
 public:
  explicit Twin(std::uint64_t seed, bool hardcore = false, bool reuse_world = false)
      : hardcore_(hardcore), reuse_world_(reuse_world), generator_(seed) {
    reset();
  }

  /// Resets without a seed.
  void reset() {
    if (physics_ && reuse_world_) {
      physics_->destroy();
    } else {
      physics_.emplace();
    }
    ground_ = draw_ground(generator_, hardcore_);
    generate_clouds(generator_);
    physics_->build(ground_, generator_.uniform(-kInitialPush, kInitialPush));
    const double no_torque[kJointCount] = {};
    step(no_torque);
  }

  void step(const double* action) {
    physics_->drive(action);
    physics_->step();
  }

  const Physics& physics() const { return *physics_; }
  const Ground& ground() const { return ground_; }

  /// Returns the hull for 0, then the limbs in action order, as in Specification::links.
  const b2Body& body(std::size_t link) const {
    return link == 0 ? physics().hull() : child_of(physics().joint(link - 1));
  }

 protected:
  bool hardcore_;
  bool reuse_world_;
  Generator generator_;
  Ground ground_;
  std::optional<Physics> physics_;
};

/// The state that a world carries from one step to the next, for comparison bit by bit.
/// Returns positions, velocities, forces and sleep times of the bodies; impulses and limits of the
/// joints; contacts in list order, with impulses and flags; all nodes of the broad-phase tree.
std::vector<std::uint32_t> words_of(Physics& physics);

/// Returns the torques that act on hull and limbs in the next step, the limbs in action order.
std::array<float, kBodies> torques_on(Physics& physics);

}  // namespace walker::bipedal_walker
