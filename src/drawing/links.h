// The shapes of a walker's links as triangles.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "walker_sim/specification.h"

namespace walker {

/// A closed surface. Each edge belongs to two faces, which share the edge's vertices.
struct Mesh {
  std::vector<Vector3> vertices;                    ///< in the link's frame [m]
  std::vector<std::array<std::uint32_t, 3>> faces;  ///< indices, counter-clockwise from outside
  Color color;
};

struct LinkShape {
  std::string name;
  std::vector<Mesh> meshes;  ///< of its prisms and solids, in this order
};

/// Returns the shapes of the specification's links, in its order. `place_links` gives the prisms'
/// depth and their position along y. Round solids have 24 segments around, whose corners are on
/// the solid's surface.
/// @throws std::invalid_argument for a joint that is not connected to the trunk
std::vector<LinkShape> link_shapes(const Specification& specification);

}  // namespace walker
