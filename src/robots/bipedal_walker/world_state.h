// Serialises the state that a world carries from one step to the next.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Box2D/Box2D.h>

#include "base/state_bytes.h"
#include "robots/bipedal_walker/kernel/kernel.h"
#include "robots/bipedal_walker/terrain.h"

namespace walker::bipedal_walker {

class Physics;

/// State of a `Physics` world that has been stepped. A step leaves no pending broad-phase pairs,
/// forces or island flags.
class WorldState {
 public:
  static void save(const Physics& physics, StateWriter& writer);

  /// Reads a state and validates every index, which `restore` relies on.
  /// @param terrain the terrain of the destination world
  /// @throws std::invalid_argument naming the invalid value
  static WorldState read(StateReader& reader, const Terrain& terrain);

  /// @param physics built with the terrain that was given to `read`
  void restore(Physics& physics) const;

 private:
  // Structs without padding, which are written and read as raw bytes.

  struct Body {
    b2Vec2 c0, c;  // these and the next three: b2Sweep
    float a0, a, alpha0;
    b2Vec2 place;
    float sine, cosine;
    b2Vec2 velocity;
    float angular_velocity;
    b2Vec2 force;
    float torque;
    float sleep_time;
    std::uint32_t is_awake;
  };

  struct TerrainBody {
    std::int32_t index;
    Body body;
  };

  struct Joint {
    std::array<float, 3> impulse;
    float motor_impulse;
    float motor_speed;
    float max_motor_torque;
    std::int32_t limit_state;
  };

  struct ContactPoint {
    b2Vec2 place;
    float normal_impulse;
    float tangent_impulse;
    std::uint32_t id;
  };

  struct Contact {
    std::int32_t fixture_a, fixture_b;  // indices: terrain, then the walker
    std::uint32_t flags;
    std::int32_t manifold_type;
    std::int32_t num_points;
    b2Vec2 normal;
    b2Vec2 point;
    std::array<ContactPoint, 2> points;
  };

  struct Node {
    b2Vec2 low, high;
    std::int32_t link;  // parent; of a free node: the next free one
    std::int32_t child1, child2;
    std::int32_t height;  // -1: free
  };

  static Body body_of(const b2Body& body);
  static Body terrain_at_rest();
  static void set_body(b2Body& body, const Body& state);
  static Contact contact_of(const b2Contact& contact, std::int32_t fixture_a,
                            std::int32_t fixture_b);
  static void save_tree(const b2DynamicTree& tree, StateWriter& writer);

  void restore_tree(b2BroadPhase& broad_phase, const std::vector<b2Fixture*>& fixtures) const;
  void restore_contacts(b2World& world, const std::vector<b2Fixture*>& fixtures) const;
  void check_numbers() const;
  void check_bodies(std::size_t num_terrain) const;
  void check_contacts(std::size_t num_obstacles, std::size_t num_terrain) const;
  void check_tree(std::size_t num_fixtures) const;
  void check_free_nodes(std::size_t num_used) const;

  std::uint8_t hull_has_touched_ = 0;
  std::array<std::uint8_t, 2> leg_touches_{};
  float inverse_dt_ = 0;  // 1 / dt of the last step
  std::array<Body, kBodies> bodies_{};
  std::vector<TerrainBody> terrain_bodies_;  // those that differ from `terrain_at_rest`
  std::array<Joint, kJoints> joints_{};
  std::vector<Contact> contacts_;     // in the world's order
  std::vector<std::int32_t> leaves_;  // tree node of each fixture
  std::int32_t root_ = 0;
  std::int32_t first_free_ = 0;
  std::vector<Node> nodes_;
};

}  // namespace walker::bipedal_walker
