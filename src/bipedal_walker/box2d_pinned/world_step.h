// A step of one b2World in pieces, between which the kernel solves many worlds together.
//
//   begin -> [solve island] -> finish_island -> (find_impact -> [solve impact] -> finish_impact)* -> end
//
// b2World::Step, Solve and SolveTOI for what a walker's world holds: one island of five bodies that are
// awake, and contacts of these with static terrain, none of them sensors or bullets. Whatever else comes
// up is done by Box2D itself.
#pragma once

#include <array>

#include "bipedal_walker/box2d_pinned/swept_vertices.h"
#include "bipedal_walker/kernel/kernel.h"
#include "bipedal_walker/walker_parts.h"

namespace walker::bipedal_walker {

class WorldStep {
 public:
  void start(const WalkerParts& parts, const Model& model);

  /// Finds out what touches what. @return whether the island is to be solved; else the step is done
  bool begin();
  Island& island() { return island_; }
  void finish_island();

  /// Moves on to the next time at which something hits the terrain. @return whether there is one
  bool find_impact();
  Impact& impact() { return impact_; }
  void finish_impact();

  void end();

 private:
  bool read_island();
  void read_contact(const b2Contact& contact, const b2Body& walker,
                    ContactManifold<float, int>& manifold) const;
  void write_bodies();
  void write_impulses();
  void fall_asleep();
  void synchronize();
  void solve_by_box2d();
  void begin_impacts();
  std::size_t index_of(const b2Body& walker) const;
  b2Contact* find_first_impact(float& alpha);
  float time_of_impact(b2Contact& contact);
  bool advance(b2Contact& contact, float alpha);
  void gather_contacts(b2Body& walker, float alpha);

  WalkerParts parts_;
  const Model* model_;
  Island island_;
  Impact impact_;
  std::array<SweptVertices, kBodies> swept_;
  std::array<b2Contact*, kMostContacts> contacts_;  ///< of the island, in its order
  int num_contacts_;
  std::array<b2Body*, kMostContacts + 2> impact_bodies_;
  int num_impact_bodies_;
};

/// Of the worlds that `Physics` builds. @param parts of any of them
Model model_of(const WalkerParts& parts);

}  // namespace walker::bipedal_walker
