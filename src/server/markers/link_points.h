// Points of the links' shapes that viewers are interested in.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "walker_sim/specification.h"

namespace walker {

/// The point of the link's shapes that lies lowest in the world, where the link has a shape.
/// @param y    where its prisms stand in the link's frame, of which this is the middle [m]
/// @param pose of the link in the world
std::optional<Eigen::Vector3d> lowest_point(const Link& link, double y, const Pose& pose);

/// How far the walker reaches from its trunk's origin with its limbs stretched out, for things that
/// are drawn as large as suits the walker [m].
double reach_of(const Specification& specification);

}  // namespace walker
