// What the environment tells about itself, read off the running Box2D world.
#pragma once

#include <memory>
#include <string>

#include <Box2D/Box2D.h>

#include "robots/bipedal_walker/physics.h"
#include "robots/bipedal_walker/terrain.h"
#include "walker_sim/sensors.h"
#include "walker_sim/specification.h"

namespace walker::bipedal_walker {

/// What a constructor may choose.
struct Options {
  std::string id;
  bool hardcore = false;
  bool reuse_world = false;
  std::uint32_t max_episode_steps = 0;  ///< for the specification; the episode enforces it
};

/// Builds a walker once and reads masses, shapes, joints and limits from its bodies. Walkers with
/// the same options share what they get as long as one of them lives. Thread-safe.
/// @param stepper of the engine's version; empty: unknown
std::shared_ptr<const Specification> make_specification(const Options& options,
                                                        const std::string& stepper = "");

/// Terrain and sky in Gymnasium's colours.
void describe_scene(const Terrain& terrain, const Clouds& clouds, Scene& scene);

/// Box2D's x,y plane is the world's x,z plane, so its positive angle turns about -y.
Vector3 to_vector3(const b2Vec2& vector);
Pose to_pose(const b2Vec2& position, float angle);

/// From a joint's body to the frame of its link, which is parallel to the hull when the joints'
/// angles are 0: the walker starts with angles 0 and its legs spread [rad].
float frame_rotation(const Physics& physics, std::size_t joint);

/// The body that a joint carries.
const b2Body& child_of(const b2RevoluteJoint& joint);

}  // namespace walker::bipedal_walker
