// The environment's specification, read from a Box2D world, and its scene.
#pragma once

#include <array>
#include <memory>
#include <string>

#include <Box2D/Box2D.h>

#include "base/random.h"
#include "robots/bipedal_walker/physics.h"
#include "walker_sim/sensors.h"
#include "walker_sim/specification.h"

namespace walker::bipedal_walker {

/// Returns what all environments have in common. Links and joints are read from a walker that is
/// built once per process, because temporary walkers fragment the heap. Thread-safe.
const Specification& common_specification();

/// Returns an environment's specification. Calls with equal arguments share it as long as it is
/// referenced. Thread-safe.
/// @param parameters complete
/// @param stepper what steps the world; appended to the engine's version unless empty
std::shared_ptr<const Specification> make_specification(const std::string& id,
                                                        const Parameters& parameters,
                                                        const std::string& stepper = "");

using Cloud = std::array<Point, 5>;
using Clouds = std::array<Cloud, kTerrainLength / 20>;

/// Draws exactly what Gymnasium's `_generate_clouds` draws, in its order.
Clouds generate_clouds(Generator& generator);

/// Sets the scene to ground, clouds and flag in Gymnasium's colours.
void describe_scene(const Ground& ground, const Clouds& clouds, Scene& scene);

/// Converts from Box2D's x,y plane to the world's x,z plane: a positive angle turns about -y.
Vector3 to_vector3(const b2Vec2& vector);
Pose to_pose(const b2Vec2& position, float angle);

/// Returns the angle of a joint's child body in the frame of its link [rad]. Link frames are
/// parallel to the hull at joint angles 0, at which the walker starts with spread legs.
float frame_rotation(const Physics& physics, std::size_t joint);

/// Returns the color of components from 0 to 255.
Color rgb(double red, double green, double blue);

const b2Body& child_of(const b2RevoluteJoint& joint);

}  // namespace walker::bipedal_walker
