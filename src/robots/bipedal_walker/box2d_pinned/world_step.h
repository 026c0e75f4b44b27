// A step of one b2World in pieces, between which the kernel solves many worlds together:
// b2World::Step and Solve up to the impacts, which world_impacts.h continues.
//
//   begin -> [solve island] -> finish_island -> impacts -> end
//
// For what Physics builds: one island of five bodies, in a chain of four joints, and contacts of
// these with static terrain; no sensors, no bullets, no damping, no restitution. Box2D gathers the
// island along the chain, so that joints come in its order and contacts body by body; a contact
// sees only its own body, so that the order of the bodies does not matter. Whatever else comes up
// is done by Box2D itself.
#pragma once

#include <array>

#include "robots/bipedal_walker/kernel/kernel.h"
#include "robots/bipedal_walker/walker_parts.h"

namespace walker::bipedal_walker {

class WorldStep {
 public:
  void start(const WalkerParts& parts, const Model& model);

  /// Finds out what touches what. @return whether the island is to be solved; else it is
  bool begin();
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
  void wake_terrain();
  void fall_asleep();
  void synchronize();

  WalkerParts parts_;
  const Model* model_;
  Island island_;
  int num_contacts_;
  unsigned num_pairs_;                             ///< contacts with two points
  std::array<b2Contact*, kMaxContacts> contacts_;  ///< in the island's order
};

/// Of the worlds that `Physics` builds. @param parts of any of them
Model model_of(const WalkerParts& parts);

}  // namespace walker::bipedal_walker
