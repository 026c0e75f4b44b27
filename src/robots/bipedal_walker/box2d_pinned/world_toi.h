// The second half of a step of one b2World, b2World::SolveTOI, in pieces:
//
//   begin -> (find -> [solve impact] -> finish)*
//
// Supports the same worlds as world_step.h.
#pragma once

#include <array>
#include <cstddef>

#include "robots/bipedal_walker/box2d_pinned/swept_vertices.h"
#include "robots/bipedal_walker/kernel/kernel.h"
#include "robots/bipedal_walker/physics.h"

namespace walker::bipedal_walker {

class WorldToi {
 public:
  void begin(const WalkerParts& parts, const Model& model);

  /// Advances a body to the first remaining impact with the terrain; returns whether there is one.
  bool find();
  ToiIsland& island() { return island_; }
  void finish();

 private:
  b2Contact* find_first(float& alpha);
  float time_of_impact(b2Contact& contact);
  bool advance(b2Contact& contact, float alpha);
  void gather_contacts(b2Body& walker, float alpha);
  void read_island(const b2Body& walker, float alpha);
  void solve_by_box2d();
  std::size_t index_of(const b2Body& walker) const;

  WalkerParts parts_;
  const Model* model_;
  std::array<SweptVertices, kBodies> swept_;
  ToiIsland island_;
  // Contents of the b2Island of one impact.
  int num_bodies_;
  int num_contacts_;
  std::array<b2Body*, std::size_t{2} * b2_maxTOIContacts> bodies_;
  std::array<b2Contact*, b2_maxTOIContacts> contacts_;
};

}  // namespace walker::bipedal_walker
