// A step of one b2World in pieces, between which the kernel solves many worlds together. This file
// has b2World::Step and Solve; world_toi.h has SolveTOI.
//
//   begin -> [solve island] -> finish_island -> WorldToi -> end
//
// Supports the worlds that Physics builds: one island of five bodies, in a chain of four joints,
// and their contacts with static terrain; no sensors, no bullets, no damping, no restitution. Box2D
// collects the island along the chain, so that joints are in its order and contacts are sorted by
// body. A contact affects only its own body, so the order of the bodies does not matter. Box2D
// itself solves what the kernel does not support: a world's first step, sleeping bodies, too many
// contacts, and non-finite results.
#pragma once

#include <array>

#include "robots/bipedal_walker/kernel/kernel.h"
#include "robots/bipedal_walker/physics.h"

namespace walker::bipedal_walker {

class WorldStep {
 public:
  /// Updates the contacts.
  /// @return whether the kernel must solve `island`; if not, Box2D has solved it
  bool begin(const WalkerParts& parts, const Model& model);
  Island& island() { return island_; }
  void finish_island();

  void end();

 private:
  bool read_island();
  bool read_contacts(const b2Body& body);
  unsigned read_joints();
  void solve_by_box2d();
  void write_bodies();
  void write_impulses();
  void set_terrain_awake(bool is_awake);
  void fall_asleep();
  void synchronize();

  WalkerParts parts_;
  const Model* model_;
  Island island_;
  int num_contacts_;
  unsigned num_pairs_;                             ///< contacts with two points
  std::array<b2Contact*, kMaxContacts> contacts_;  ///< in the island's order
};

/// Returns the model that all worlds of `Physics` share, read from any of them.
Model model_of(const WalkerParts& parts);

}  // namespace walker::bipedal_walker
