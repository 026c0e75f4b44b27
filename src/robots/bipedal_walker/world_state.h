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
    b2Transform transform;
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
    b2Vec3 impulse;
    float motor_impulse;
    float motor_speed;
    float max_motor_torque;
    std::int32_t limit_state;
  };

  /// Unused fields of a manifold are 0, so that equal states have equal bytes.
  struct Contact {
    std::int32_t fixture_a, fixture_b;  // indices: terrain, then the walker
    std::uint32_t flags;
    std::int32_t manifold_type;
    std::int32_t num_points;
    b2Vec2 normal;
    b2Vec2 point;
    std::array<b2ManifoldPoint, b2_maxManifoldPoints> points;
  };

  struct Node {
    b2AABB box;
    std::int32_t link;  // parent; of a free node: the next free one
    std::int32_t child1, child2;
    std::int32_t height;  // -1: free
  };

  void check_numbers() const;
  void check_contacts(std::size_t num_obstacles, std::size_t num_terrain) const;
  void check_tree(std::size_t num_fixtures) const;
  void check_node(std::int32_t index, bool is_leaf) const;
  const Node& node_at(std::int32_t index) const;
  void restore_tree(b2BroadPhase& broad_phase, const std::vector<b2Fixture*>& fixtures) const;
  void restore_contacts(b2World& world, const std::vector<b2Fixture*>& fixtures) const;

  std::array<std::uint8_t, 3> touches_{};  // hull, lower legs
  float inverse_dt_ = 0;                   // 1 / dt of the last step
  std::array<Body, kBodies> bodies_{};
  std::vector<TerrainBody> terrain_bodies_;  // those that are not at rest
  std::array<Joint, kJoints> joints_{};
  std::vector<Contact> contacts_;     // in the world's order
  std::vector<std::int32_t> leaves_;  // tree node of each fixture
  std::int32_t root_ = 0;
  std::int32_t first_free_ = 0;
  std::vector<Node> nodes_;
};

}  // namespace walker::bipedal_walker
