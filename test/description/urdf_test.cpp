// The committed robot description equals the one that the running environment gives. Its numbers,
// read by urdfdom, equal the specification's.
#include "description/urdf.h"

#include <gtest/gtest.h>
#include <urdf/model.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "description/urdf_geometry.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

// The engine and the file have single precision; other versions of the engine round differently.
constexpr double kTolerance = 2e-7;  // relative
// Sizes and angles of shapes, derived from several single-precision numbers [m, rad].
constexpr double kShapeTolerance = 1e-6;

/// Corners (x, z) of a cross-section.
using Corners = std::vector<std::array<double, 2>>;

void expect_same_corners(const Corners& expected, const Corners& actual, const std::string& what) {
  ASSERT_EQ(expected.size(), actual.size()) << what;
  for (const auto& corner : expected) {
    const bool found = std::any_of(actual.begin(), actual.end(), [&](const auto& other) {
      return std::hypot(corner[0] - other[0], corner[1] - other[1]) < kShapeTolerance;
    });
    EXPECT_TRUE(found) << what << ": no corner at " << corner[0] << ", " << corner[1];
  }
}

Corners corners_of(const urdf::Box& box, const urdf::Pose& pose) {
  Corners corners;
  for (const double x : {-0.5, 0.5}) {
    for (const double z : {-0.5, 0.5}) {
      const urdf::Vector3 corner = pose.rotation * urdf::Vector3(x * box.dim.x, 0, z * box.dim.z);
      EXPECT_NEAR(corner.y, 0, kShapeTolerance);
      corners.push_back({corner.x + pose.position.x, corner.z + pose.position.z});
    }
  }
  return corners;
}

/// Triangles.
using Mesh = std::vector<std::array<Vector3, 3>>;

Mesh read_stl(const std::string& path) {
  constexpr std::size_t kHeader = 80;
  constexpr std::size_t kFacet = 50;
  constexpr std::size_t kNormal = 12;
  const std::string file = read_source(path);
  EXPECT_NE(file.compare(0, 5, "solid"), 0) << "readers would take it for a text";
  std::uint32_t count = 0;
  std::memcpy(&count, file.data() + kHeader, sizeof(count));
  EXPECT_EQ(file.size(), kHeader + sizeof(count) + count * kFacet);
  Mesh mesh;
  for (std::size_t i = 0; i < count; ++i) {
    std::array<float, 9> values{};
    std::memcpy(values.data(), file.data() + kHeader + sizeof(count) + i * kFacet + kNormal,
                sizeof(values));
    std::array<Vector3, 3> triangle{};
    for (std::size_t k = 0; k < values.size(); ++k) triangle[k / 3][k % 3] = double{values[k]};
    mesh.push_back(triangle);
  }
  return mesh;
}

std::vector<double> numbers_in(const std::string& file, const std::string& begin) {
  const std::size_t start = file.find('>', file.find(begin) + begin.size() - 1) + 1;
  std::istringstream text(file.substr(start, file.find('<', start) - start));
  return {std::istream_iterator<double>(text), {}};
}

Mesh read_collada(const std::string& path) {
  const std::string file = read_source(path);
  EXPECT_NE(file.find("<up_axis>Z_UP</up_axis>"), std::string::npos);
  const std::vector<double> corners = numbers_in(file, "<float_array id=\"corners_values\"");
  const std::vector<double> normals = numbers_in(file, "<float_array id=\"normals_values\"");
  const std::vector<double> indices = numbers_in(file, "<p>");
  EXPECT_EQ(corners.size(), normals.size());
  EXPECT_EQ(3 * indices.size(), corners.size());
  Mesh mesh;
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
    std::array<Vector3, 3> triangle{};
    for (std::size_t k = 0; k < 9; ++k) {
      triangle[k / 3][k % 3] = corners.at(3 * static_cast<std::size_t>(indices[i + k / 3]) + k % 3);
    }
    for (std::size_t edge = 0; edge < 2; ++edge) {
      double along = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        along += (triangle[edge + 1][k] - triangle[edge][k]) * normals.at(3 * i + k);
      }
      EXPECT_NEAR(along, 0, kShapeTolerance) << "a normal that stands askew";
    }
    mesh.push_back(triangle);
  }
  return mesh;
}

Mesh read_mesh(const std::string& path) {
  return path.substr(path.size() - 4) == ".stl" ? read_stl(path) : read_collada(path);
}

Corners corners_of(const Mesh& mesh) {
  Corners corners;
  for (const auto& triangle : mesh) {
    for (const Vector3& point : triangle) {
      const std::array<double, 2> corner{point[0], point[2]};
      if (std::find(corners.begin(), corners.end(), corner) == corners.end()) {
        corners.push_back(corner);
      }
    }
  }
  return corners;
}

double volume_of(const Mesh& mesh) {
  double volume = 0;
  for (const auto& [a, b, c] : mesh) {
    volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
               a[2] * (b[0] * c[1] - b[1] * c[0])) /
              6;
  }
  return volume;
}

double area_of(const Prism& prism) {
  double area = 0;
  for (std::size_t i = 0; i < prism.vertices.size(); ++i) {
    const auto [x0, z0] = prism.vertices[i];
    const auto [x1, z1] = prism.vertices[(i + 1) % prism.vertices.size()];
    area += (x0 * z1 - x1 * z0) / 2;
  }
  return area;
}

class CommittedUrdf : public CommittedUrdfTest {
 protected:
  CommittedUrdf() : CommittedUrdfTest("bipedal_walker", "BipedalWalker-v3") {}
};

TEST_F(CommittedUrdf, EqualsTheGeneratedOne) {
  const UrdfFiles files = make_urdf(specification(), "bipedal_walker");
  EXPECT_EQ(files.urdf, text_);
  ASSERT_EQ(files.meshes.size(), specification().links.size() + 1) << "to be seen, and to collide";
  for (const std::string& name : files.meshes) {
    EXPECT_FALSE(read_source("assets/" + name).empty());
  }
}

TEST_F(CommittedUrdf, FitsTheHardcoreVariantToo) {
  const auto hardcore = make("BipedalWalkerHardcore-v3");
  EXPECT_EQ(without_comment(make_urdf(hardcore->specification(), "bipedal_walker").urdf),
            without_comment(make_urdf(specification(), "bipedal_walker").urdf));
}

TEST_F(CommittedUrdf, HasExactlyTheSpecifiedLinksMassesAndJoints) {
  EXPECT_EQ(model_.getName(), "bipedal_walker");
  EXPECT_EQ(model_.getRoot()->name, specification().links.front().name);
  EXPECT_EQ(model_.links_.size(), specification().links.size());
  EXPECT_EQ(model_.joints_.size(), specification().joints.size());
  expect_masses(specification(), model_, kTolerance);
}

// Any two principal moments of a rigid body sum to at least the third. y is a principal axis, so
// the x-z block is diagonalised.
TEST_F(CommittedUrdf, HasPhysicalInertias) {
  for (const auto& [name, link] : model_.links_) {
    const urdf::Inertial& body = *link->inertial;
    EXPECT_EQ(body.ixy, 0) << name;
    EXPECT_EQ(body.iyz, 0) << name;
    const double mean = (body.ixx + body.izz) / 2;
    const double radius = std::hypot((body.ixx - body.izz) / 2, body.ixz);
    const double low = mean - radius;
    const double high = mean + radius;
    EXPECT_GT(low, 0) << name;
    EXPECT_GE(low + high, body.iyy) << name;
    EXPECT_GE(low + body.iyy, high) << name;
  }
}

// For a uniform prism of the drawn depth d, the moment about y, known from the engine, follows from
// the other two: ixx + izz = iyy + m d^2 / 6.
TEST_F(CommittedUrdf, HasTheInertiasOfUniformPrisms) {
  for (const Link& link : specification().links) {
    const urdf::Inertial& body = *model_.getLink(link.name)->inertial;
    const double depth = &link == &specification().links.front() ? kTrunkDepth : kLimbDepth;
    EXPECT_NEAR(body.ixx + body.izz, body.iyy + body.mass * depth * depth / 6, 1e-6) << link.name;
  }
}

TEST_F(CommittedUrdf, HasTheShapesOfTheWorld) {
  for (const Link& link : specification().links) {
    const urdf::LinkConstSharedPtr found = model_.getLink(link.name);
    ASSERT_EQ(link.prisms.size(), 1U) << link.name;
    ASSERT_EQ(found->visual_array.size(), 1U) << link.name;
    ASSERT_EQ(found->collision_array.size(), 1U) << link.name;
    const std::array<std::pair<urdf::GeometrySharedPtr, urdf::Pose>, 2> drawn{
        {{found->visual->geometry, found->visual->origin},
         {found->collision->geometry, found->collision->origin}}};
    for (const auto& [geometry, pose] : drawn) {
      if (geometry->type == urdf::Geometry::BOX) {
        const auto& box = static_cast<const urdf::Box&>(*geometry);
        expect_same_corners(link.prisms[0].vertices, corners_of(box, pose), link.name);
        continue;
      }
      ASSERT_EQ(geometry->type, urdf::Geometry::MESH) << link.name;
      const std::string url = static_cast<const urdf::Mesh&>(*geometry).filename;
      const std::string package = "package://walker_sim/";
      ASSERT_EQ(url.rfind(package, 0), 0U) << url;
      EXPECT_EQ(pose.position.x, 0);
      EXPECT_EQ(pose.position.z, 0);
      EXPECT_EQ(pose.rotation.w, 1);
      const Mesh mesh = read_mesh(url.substr(package.size()));
      expect_same_corners(link.prisms[0].vertices, corners_of(mesh), link.name);
      const double depth = link.name == "hull" ? kTrunkDepth : kLimbDepth;
      EXPECT_NEAR(volume_of(mesh), area_of(link.prisms[0]) * depth, kShapeTolerance);
    }
  }
}

/// A fully lit face has the link's colour, and no face is black.
TEST_F(CommittedUrdf, MeshesHaveTheLinksColours) {
  for (const Link& link : specification().links) {
    SCOPED_TRACE(link.name);
    const std::string file = read_source("assets/bipedal_walker_" + link.name + ".dae");
    const std::vector<double> own = numbers_in(file, "<emission><color");
    const std::vector<double> lit = numbers_in(file, "<diffuse><color");
    ASSERT_EQ(own.size(), 4U);
    ASSERT_EQ(lit.size(), 4U);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(own[k] + lit[k], link.color[k], 1e-6);
      EXPECT_GT(own[k], link.color[k] / 2);
    }
  }
}

// The engine's legs lie in one plane, where they would hide each other.
TEST_F(CommittedUrdf, DrawsTheLegsBesideTheHull) {
  const auto y = [this](const std::string& link) {
    return model_.getLink(link)->visual->origin.position.y;
  };
  EXPECT_EQ(y("hull"), 0);
  EXPECT_GT(y("upper_leg_1"), (kTrunkDepth + kLimbDepth) / 2);
  EXPECT_LT(y("upper_leg_2"), -(kTrunkDepth + kLimbDepth) / 2);
  EXPECT_EQ(y("lower_leg_1"), y("upper_leg_1"));
  EXPECT_EQ(y("lower_leg_2"), y("upper_leg_2"));
}

TEST_F(CommittedUrdf, HasTheJointsOfTheWorld) {
  expect_joints(specification(), model_, kTolerance);
  for (const Joint& joint : specification().joints) {
    EXPECT_EQ(model_.getJoint(joint.name)->child_link_name, joint.child);
    EXPECT_EQ(model_.getJoint(joint.name)->limits->velocity, joint.maximum_velocity);
  }
}

TEST(MakeUrdf, RejectsAMissingParentACycleAndALinkWithoutShape) {
  const Specification good = make("BipedalWalker-v3")->specification();
  Specification orphan = good;
  orphan.joints.front().parent = "tail";
  Specification cycle = good;
  cycle.joints[0].parent = cycle.joints[1].child;
  Specification invisible = good;
  invisible.links.back().prisms.clear();
  for (const Specification& bad : {orphan, cycle, invisible}) {
    EXPECT_THROW(make_urdf(bad, "x"), std::invalid_argument);
  }
}

TEST(RobotName, IsTheIdWithoutVersionInSnakeCase) {
  EXPECT_EQ(robot_name("BipedalWalker-v3"), "bipedal_walker");
  EXPECT_EQ(robot_name("BipedalWalkerHardcore-v3"), "bipedal_walker_hardcore");
  EXPECT_EQ(robot_name("Walker2d-v4"), "walker2d");
}

}  // namespace
}  // namespace walker
