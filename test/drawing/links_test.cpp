// Meshes of links: closed surfaces around the right volume, at the right place.
#include "drawing/links.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "description/link_tree.h"
#include "drawing/drawing.h"
#include "drawing/shown_walker.h"
#include "test_name.h"

namespace walker::test {
namespace {

const double kPi = std::acos(-1.0);

/// Each edge of a face is that of exactly one other face, in the opposite direction.
void expect_closed(const Mesh& mesh) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const auto& [a, b, c] : mesh.faces) {
    for (const auto& edge : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) {
      EXPECT_LT(edge.first, mesh.vertices.size());
      EXPECT_TRUE(edges.insert(edge).second) << edge.first << " to " << edge.second << " twice";
    }
  }
  EXPECT_FALSE(edges.empty());
  for (const auto& [from, to] : edges) EXPECT_EQ(edges.count({to, from}), 1U) << from << " " << to;
}

/// Positive if the faces are counter-clockwise from outside.
double volume(const Mesh& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.faces) {
    sum += to_eigen(mesh.vertices[a])
               .dot(to_eigen(mesh.vertices[b]).cross(to_eigen(mesh.vertices[c])));
  }
  return sum / 6;
}

double area(const Prism& prism) {
  double sum = 0;
  for (std::size_t i = 0; i < prism.vertices.size(); ++i) {
    const auto& [x, z] = prism.vertices[i];
    const auto& [next_x, next_z] = prism.vertices[(i + 1) % prism.vertices.size()];
    sum += (x * next_z - next_x * z) / 2;
  }
  return sum;
}

double volume(const Solid& solid) {
  const auto [first, second, third] = solid.size;
  const double ball = 4 * kPi / 3 * first * first * first;
  const double cylinder = 2 * kPi * first * first * second;
  switch (solid.kind) {
    case Solid::Kind::sphere:
      return ball;
    case Solid::Kind::capsule:
      return ball + cylinder;
    case Solid::Kind::cylinder:
      return cylinder;
    case Solid::Kind::box:
      break;
  }
  return 8 * first * second * third;
}

class LinksOfEveryEnvironment : public testing::TestWithParam<std::string> {};

TEST_P(LinksOfEveryEnvironment, AreClosedAndOfTheirVolume) {
  const ShownWalker shown(GetParam());
  const Specification& specification = shown.specification();
  const std::map<std::string, Place> places = place_links(specification);
  const std::vector<LinkShape> shapes = link_shapes(specification);
  ASSERT_EQ(shapes.size(), specification.links.size());
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const Link& link = specification.links[i];
    SCOPED_TRACE(link.name);
    EXPECT_EQ(shapes[i].name, link.name);
    ASSERT_EQ(shapes[i].meshes.size(), link.prisms.size() + link.solids.size());
    auto mesh = shapes[i].meshes.begin();
    for (const Prism& prism : link.prisms) {
      const auto [y, depth] = places.at(link.name);
      EXPECT_NEAR(volume(*mesh), area(prism) * depth, 1e-12);
      const auto [near, far] =
          std::minmax_element(mesh->vertices.begin(), mesh->vertices.end(),
                              [](const Vector3& a, const Vector3& b) { return a[1] < b[1]; });
      EXPECT_NEAR((*near)[1], y - depth / 2, 1e-12);
      EXPECT_NEAR((*far)[1], y + depth / 2, 1e-12);
      ++mesh;
    }
    for (const Solid& solid : link.solids) {
      EXPECT_LE(volume(*mesh), volume(solid) * (1 + 1e-9));
      EXPECT_GT(volume(*mesh), 0.96 * volume(solid));
      ++mesh;
    }
    for (const Mesh& each : shapes[i].meshes) {
      expect_closed(each);
      EXPECT_EQ(each.color, link.color);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, LinksOfEveryEnvironment, testing::ValuesIn(ids()), kNameOfId);

/// The lowest vertex is that of the solid itself, however it is turned.
TEST(LinkShapes, AreWhereTheSolidsAre) {
  for (const Solid::Kind kind :
       {Solid::Kind::sphere, Solid::Kind::capsule, Solid::Kind::cylinder, Solid::Kind::box}) {
    SCOPED_TRACE(static_cast<int>(kind));
    Specification specification;
    Link& link = specification.links.emplace_back();
    link.name = "trunk";
    const Solid solid{kind, {{0.1, -0.7, 0.3}, {0.5, 0.1, -0.7, 0.5}}, {0.2, 0.4, 0.5}};
    link.solids.push_back(solid);
    const std::vector<LinkShape> shapes = link_shapes(specification);
    const Mesh& mesh = shapes.front().meshes.front();
    expect_closed(mesh);
    EXPECT_LE(volume(mesh), volume(solid) * (1 + 1e-9));
    EXPECT_GT(volume(mesh), 0.96 * volume(solid));
    for (const double angle : {0.0, 0.7, 1.6, 2.9, 4.2, 5.5}) {
      const Pose pose{{0, 0, 0}, {std::sin(angle / 2), 0, 0, std::cos(angle / 2)}};
      double lowest = 100;
      for (const Vector3& vertex : mesh.vertices) {
        lowest = std::min(lowest, (to_eigen(pose) * to_eigen(vertex)).z());
      }
      const double of_solid = lowest_point(link, 0, pose)->z();
      EXPECT_GE(lowest, of_solid - 1e-9) << angle;
      EXPECT_LT(lowest, of_solid + 0.02 * solid.size[0]) << angle;
    }
  }
}

}  // namespace
}  // namespace walker::test
