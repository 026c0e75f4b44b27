// Specification against the bodies and joints of a twin.
#include "robots/bipedal_walker/specification.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "robots/bipedal_walker/twin_walk.h"

namespace walker::bipedal_walker {
namespace {

constexpr double kSingle = 1e-5;  // tolerance for single precision [m, rad]

/// Transforms a point of a link to the world's x,z plane [m].
b2Vec2 in_world(const Pose& pose, double x, double z) {
  const double angle = -2 * std::atan2(pose.orientation[1], pose.orientation[3]);
  return {static_cast<float>(pose.position[0] + std::cos(angle) * x - std::sin(angle) * z),
          static_cast<float>(pose.position[2] + std::sin(angle) * x + std::cos(angle) * z)};
}

void expect_near(const b2Vec2& ours, const b2Vec2& theirs) {
  EXPECT_NEAR(ours.x, theirs.x, kSingle);
  EXPECT_NEAR(ours.y, theirs.y, kSingle);
}

class SpecificationTest : public TwinWalk {
 protected:
  void SetUp() override {
    TwinWalk::SetUp();
    walk([](const std::vector<double>& /*action*/) {}, 60);
    ASSERT_FALSE(walker_.has_ended());
  }

  std::size_t link_index(const std::string& name) const {
    for (std::size_t i = 0; i < specification().links.size(); ++i) {
      if (specification().links[i].name == name) return i;
    }
    throw std::out_of_range(name);
  }
};

TEST_F(SpecificationTest, LinksHaveTheBodiesMasses) {
  ASSERT_EQ(specification().links.size(), 5U);
  for (std::size_t i = 0; i < specification().links.size(); ++i) {
    const Link& link = specification().links[i];
    SCOPED_TRACE(link.name);
    const b2Body& body = twin_.body(i);
    EXPECT_EQ(link.mass, double{body.GetMass()});
    const auto arm = double{body.GetLocalCenter().Length()};
    EXPECT_NEAR(link.inertia.yy, double{body.GetInertia()} - link.mass * arm * arm, 1e-6);
    expect_near(in_world(sensors_.link_poses[i], link.center_of_mass[0], link.center_of_mass[2]),
                body.GetWorldCenter());
    EXPECT_EQ(link.center_of_mass[1], 0);
  }
}

TEST_F(SpecificationTest, ShapesAreTheFixtures) {
  for (std::size_t i = 0; i < specification().links.size(); ++i) {
    const Link& link = specification().links[i];
    SCOPED_TRACE(link.name);
    const b2Fixture* fixture = twin_.body(i).GetFixtureList();
    ASSERT_EQ(link.prisms.size(), 1U);
    ASSERT_EQ(fixture->GetNext(), nullptr);
    const auto* polygon = static_cast<const b2PolygonShape*>(fixture->GetShape());
    const auto& vertices = link.prisms[0].vertices;
    ASSERT_EQ(vertices.size(), static_cast<std::size_t>(polygon->m_count));
    double area = 0;
    for (std::size_t k = 0; k < vertices.size(); ++k) {
      expect_near(in_world(sensors_.link_poses[i], vertices[k][0], vertices[k][1]),
                  twin_.body(i).GetWorldPoint(polygon->m_vertices[k]));
      const auto& next = vertices[(k + 1) % vertices.size()];
      area += (vertices[k][0] * next[1] - next[0] * vertices[k][1]) / 2;
    }
    EXPECT_GT(area, 0) << "counter-clockwise";
  }
}

TEST_F(SpecificationTest, JointsAreBox2ds) {
  const std::vector<Joint>& joints = specification().joints;
  ASSERT_EQ(joints.size(), std::size_t{kJointCount});
  Twin fresh(kSeed);  // its motors still have the torque limit of the joint definition
  const std::vector<std::string> names{"hip_1", "knee_1", "hip_2", "knee_2"};
  for (std::size_t i = 0; i < joints.size(); ++i) {
    SCOPED_TRACE(names[i]);
    const b2RevoluteJoint& engine = twin_.physics().joint(i);
    const bool is_hip = i % 2 == 0;
    EXPECT_EQ(joints[i].name, names[i]);
    EXPECT_EQ(joints[i].lower, double{engine.GetLowerLimit()});
    EXPECT_EQ(joints[i].upper, double{engine.GetUpperLimit()});
    EXPECT_EQ(joints[i].lower, double{is_hip ? -0.8F : -1.6F});
    EXPECT_EQ(joints[i].upper, double{is_hip ? 1.1F : -0.1F});
    EXPECT_TRUE(engine.IsLimitEnabled());
    EXPECT_TRUE(engine.IsMotorEnabled());
    EXPECT_EQ(joints[i].maximum_effort, 80);
    EXPECT_EQ(joints[i].maximum_velocity, is_hip ? 4 : 6);
    EXPECT_EQ(joints[i].axis, (Vector3{0, -1, 0}));
  }
}

/// Joint origins, positions and poses agree, within the error of the engine's joint constraints.
TEST_F(SpecificationTest, FramesFormBox2dsChain) {
  for (std::size_t i = 0; i < specification().joints.size(); ++i) {
    const Joint& joint = specification().joints[i];
    SCOPED_TRACE(joint.name);
    const Pose& parent = sensors_.link_poses[link_index(joint.parent)];
    const Pose& child = sensors_.link_poses[link_index(joint.child)];
    const b2RevoluteJoint& engine = twin_.physics().joint(i);
    expect_near(in_world(parent, joint.origin[0], joint.origin[2]), engine.GetAnchorA());
    expect_near(in_world(child, 0, 0), engine.GetAnchorB());
    const auto angle_of = [](const Pose& pose) {
      return 2 * std::atan2(pose.orientation[1], pose.orientation[3]);
    };
    const double turned = angle_of(child) - angle_of(parent);
    EXPECT_NEAR(turned, joint.axis[1] * sensors_.joint_position[i], kSingle);
    EXPECT_EQ(link_index(joint.child), i + 1) << "links in action order";
    EXPECT_EQ(joint.parent, i % 2 == 0 ? "hull" : specification().links[i].name);
  }
}

TEST_F(SpecificationTest, NamesAndEfforts) {
  EXPECT_EQ(specification().observation_dtype, "float32");
  EXPECT_TRUE(specification().info_names.empty());
  EXPECT_EQ(specification().effort_per_action, std::vector<double>(kJointCount, 80));
  for (const std::string& name : specification().contact_links) EXPECT_NO_THROW(link_index(name));
  EXPECT_EQ(specification().contact_links.size(), 2U);
}

TEST_F(SpecificationTest, NamesTheEngine) {
  namespace fs = std::filesystem;
  EXPECT_EQ(specification().engine, "Box2D");
  const std::string& version = specification().engine_version;
  const std::string& path = specification().engine_path;
  ASSERT_TRUE(fs::exists(path)) << path;
  EXPECT_EQ(version.substr(0, 4), "2.3.");
  EXPECT_NE(version.find("pinned"), std::string::npos) << version;
  EXPECT_TRUE(fs::equivalent(path, "/proc/self/exe")) << path << ": linked into this test";
}

}  // namespace
}  // namespace walker::bipedal_walker
