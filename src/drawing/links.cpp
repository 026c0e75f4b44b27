#include "drawing/links.h"

#include <cmath>
#include <map>
#include <utility>

#include "description/link_tree.h"

namespace walker {
namespace {

constexpr std::uint32_t kSegments = 24;  // around an axis; half as many from pole to pole
const double kHalfTurn = std::acos(-1.0);

/// Sweeps a convex polygon along y.
/// @param outline x, z, counter-clockwise seen from -y
/// @param y       centre [m]
Mesh extrude(const std::vector<std::array<double, 2>>& outline, double y, double depth,
             const Color& color) {
  Mesh mesh{{}, {}, color};
  for (const double side : {-depth / 2, depth / 2}) {
    for (const auto& [x, z] : outline) mesh.vertices.push_back({x, y + side, z});
  }
  const auto count = static_cast<std::uint32_t>(outline.size());
  for (std::uint32_t i = 1; i + 1 < count; ++i) {
    mesh.faces.push_back({0, i, i + 1});
    mesh.faces.push_back({count, count + i + 1, count + i});
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t next = (i + 1) % count;
    mesh.faces.push_back({next, i, count + i});
    mesh.faces.push_back({next, count + i, count + next});
  }
  return mesh;
}

/// A circle about the z axis [m].
struct Ring {
  double radius;
  double z;
};

/// Returns the surface between two points of the z axis and the rings between them.
/// @param rings from the lowest to the highest
Mesh revolve(double bottom, const std::vector<Ring>& rings, double top, const Color& color) {
  Mesh mesh{{{0, 0, bottom}, {0, 0, top}}, {}, color};
  for (const auto& [radius, z] : rings) {
    for (std::uint32_t i = 0; i < kSegments; ++i) {
      const double angle = 2 * kHalfTurn * i / kSegments;
      mesh.vertices.push_back({radius * std::cos(angle), radius * std::sin(angle), z});
    }
  }
  const auto vertex = [](std::size_t ring, std::uint32_t i) {
    return 2 + static_cast<std::uint32_t>(ring) * kSegments + i % kSegments;
  };
  const std::size_t last = rings.size() - 1;
  for (std::uint32_t i = 0; i < kSegments; ++i) {
    mesh.faces.push_back({0, vertex(0, i + 1), vertex(0, i)});
    for (std::size_t ring = 0; ring < last; ++ring) {
      mesh.faces.push_back({vertex(ring, i), vertex(ring, i + 1), vertex(ring + 1, i + 1)});
      mesh.faces.push_back({vertex(ring, i), vertex(ring + 1, i + 1), vertex(ring + 1, i)});
    }
    mesh.faces.push_back({1, vertex(last, i), vertex(last, i + 1)});
  }
  return mesh;
}

/// Returns a cylinder between two hemispheres; a sphere if `half_length` is 0.
Mesh capsule(double radius, double half_length, const Color& color) {
  constexpr std::uint32_t kQuarter = kSegments / 4;
  std::vector<Ring> rings;
  const auto add_ring = [&](double latitude, double z) {
    rings.push_back({radius * std::cos(latitude), z + radius * std::sin(latitude)});
  };
  const auto latitude = [](std::uint32_t i) { return kHalfTurn / 2 * i / kQuarter; };
  for (std::uint32_t i = kQuarter - 1; i > 0; --i) add_ring(-latitude(i), -half_length);
  add_ring(0, -half_length);
  if (half_length > 0) add_ring(0, half_length);
  for (std::uint32_t i = 1; i < kQuarter; ++i) add_ring(latitude(i), half_length);
  const double pole = half_length + radius;
  return revolve(-pole, rings, pole, color);
}

/// Returns the solid's surface in the frame of its own pose.
Mesh to_mesh(const Solid& solid, const Color& color) {
  const auto [first, second, third] = solid.size;
  switch (solid.kind) {
    case Solid::Kind::sphere:
      break;
    case Solid::Kind::capsule:
      return capsule(first, second, color);
    case Solid::Kind::cylinder:
      return revolve(-second, {{first, -second}, {first, second}}, second, color);
    case Solid::Kind::box:
      return extrude({{-first, -third}, {first, -third}, {first, third}, {-first, third}}, 0,
                     2 * second, color);
  }
  return capsule(first, 0, color);
}

}  // namespace

std::vector<LinkShape> link_shapes(const Specification& specification) {
  const std::map<std::string, Place> places = place_links(specification);
  std::vector<LinkShape> shapes;
  for (const Link& link : specification.links) {
    LinkShape& shape = shapes.emplace_back(LinkShape{link.name, {}});
    const auto [y, depth] = places.at(link.name);
    for (const Prism& prism : link.prisms) {
      shape.meshes.push_back(extrude(prism.vertices, y, depth, link.color));
    }
    for (const Solid& solid : link.solids) {
      const Eigen::Isometry3d to_link = to_eigen(solid.pose);
      Mesh& mesh = shape.meshes.emplace_back(to_mesh(solid, link.color));
      for (Vector3& vertex : mesh.vertices) {
        Eigen::Map<Eigen::Vector3d> point(vertex.data());
        point = to_link * point.eval();
      }
    }
  }
  return shapes;
}

}  // namespace walker
