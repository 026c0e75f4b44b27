// Specification and sensors against the bodies of a twin during an episode.
#include "robots/bipedal_walker/specification.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>

#include "robots/bipedal_walker/player.h"
#include "robots/bipedal_walker/twin.h"

namespace walker::bipedal_walker {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Fraction of the ray up to the nearest ground, found by brute force; infinity without a hit.
double nearest_ground(const Physics& physics, const b2Vec2& from, const b2Vec2& to) {
  b2RayCastInput ray;
  ray.p1 = from;
  ray.p2 = to;
  ray.maxFraction = 1;
  double nearest = kInfinity;
  for (const b2Body* body = physics.world().GetBodyList(); body; body = body->GetNext()) {
    if (body->GetType() != b2_staticBody) continue;
    b2RayCastOutput hit;
    const b2Shape* shape = body->GetFixtureList()->GetShape();
    if (shape->RayCast(&hit, ray, body->GetTransform(), 0)) {
      nearest = std::min(nearest, double{hit.fraction});
    }
  }
  return nearest;
}

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

class SensorsTest : public testing::Test {
 protected:
  static constexpr std::uint64_t kSeed = 3;

  void SetUp() override { walker_.reset(kSeed); }

  /// Calls `check` after the reset and after each of up to `num_steps` steps.
  template <typename Check>
  void walk(Check check, int num_steps = 300) {
    Actions actions("heuristic", 0);
    std::vector<double> action(kJointCount, 0);
    walker_.environment->sense(sensors_);
    check(action);
    for (step_ = 1; step_ <= num_steps && !walker_.has_ended(); ++step_) {
      SCOPED_TRACE("step " + std::to_string(step_));
      actions.draw(walker_.observation, action);
      walker_.step(action);
      twin_.step(action.data());
      walker_.environment->sense(sensors_);
      check(action);
    }
    EXPECT_GT(step_, std::min(num_steps, 100));
  }

  const b2Body& hull() const { return twin_.physics().hull(); }
  const Specification& specification() const { return walker_.environment->specification(); }

  Stepper walker_{"BipedalWalker-v3"};
  Twin twin_{kSeed};
  Sensors sensors_;
  int step_ = 0;
};

TEST_F(SensorsTest, JointsAreBox2dsAndTheObservations) {
  double max_effort = 0;
  walk([&](const std::vector<double>& action) {
    for (std::size_t i = 0; i < kJointCount; ++i) {
      const b2RevoluteJoint& joint = twin_.physics().joint(i);
      const std::size_t index = (i < 2 ? kFirstLeg : kSecondLeg) + 2 * (i % 2);
      const double shift = i % 2 == 0 ? 0 : 1;
      const double max_speed = i % 2 == 0 ? 4 : 6;
      EXPECT_EQ(sensors_.joint_position[i], double{joint.GetJointAngle()});
      EXPECT_NEAR(sensors_.joint_position[i] + shift, walker_.observation[index], 1e-6);
      EXPECT_EQ(sensors_.joint_velocity[i], double{joint.GetJointSpeed()});
      EXPECT_NEAR(sensors_.joint_velocity[i] / max_speed, walker_.observation[index + 1], 1e-6);
      EXPECT_EQ(sensors_.joint_effort[i], double{joint.GetMotorTorque(50)});
      EXPECT_LE(std::abs(sensors_.joint_effort[i]), 80 * std::abs(action[i]) + 1e-3);
      max_effort = std::max(max_effort, std::abs(sensors_.joint_effort[i]));
    }
  });
  EXPECT_NEAR(max_effort, 80, 1e-3);
}

TEST_F(SensorsTest, LinkPosesAreTheBodies) {
  walk([this](const std::vector<double>& /*action*/) {
    for (std::size_t i = 0; i <= kJointCount; ++i) {
      const Pose& pose = sensors_.link_poses[i];
      const b2Body& body = twin_.body(i);
      const bool is_hull = i == 0;
      const b2Vec2 position =
          is_hull ? body.GetPosition() : twin_.physics().joint(i - 1).GetAnchorB();
      EXPECT_EQ(pose.position, (Vector3{double{position.x}, 0, double{position.y}}));
      // At joint angle 0, the bodies of the legs are turned by 0.05 rad; their link frames are not.
      const double leg_spread = i < 3 ? -0.05 : 0.05;
      const double spread = is_hull ? 0 : leg_spread;
      const double half = (double{body.GetAngle()} - spread) / 2;
      EXPECT_NEAR(pose.orientation[1], -std::sin(half), 1e-6);
      EXPECT_NEAR(pose.orientation[3], std::cos(half), 1e-6);
      EXPECT_EQ(pose.orientation[0], 0);
      EXPECT_EQ(pose.orientation[2], 0);
    }
  });
}

TEST_F(SensorsTest, VelocityIsTheOrigins) {
  double max_difference = 0;
  walk([this, &max_difference](const std::vector<double>& /*action*/) {
    const b2Vec2 arm = hull().GetPosition() - hull().GetWorldCenter();
    const auto omega = double{hull().GetAngularVelocity()};
    const b2Vec2 center = hull().GetLinearVelocity();
    EXPECT_NEAR(sensors_.linear_velocity[0], double{center.x} - omega * double{arm.y}, 1e-5);
    EXPECT_NEAR(sensors_.linear_velocity[2], double{center.y} + omega * double{arm.x}, 1e-5);
    EXPECT_EQ(sensors_.linear_velocity[1], 0);
    EXPECT_EQ(sensors_.angular_velocity, (Vector3{0, -omega, 0}));
    max_difference = std::max(max_difference, std::abs(omega) * double{arm.Length()});
  });
  EXPECT_GT(max_difference, 0.01) << "else the centre's velocity would have passed";
}

TEST_F(SensorsTest, AccelerationIsTheChangeOfVelocity) {
  Vector3 before{};
  double largest = 0;
  walk([this, &before, &largest](const std::vector<double>& /*action*/) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(sensors_.linear_acceleration[k], 50 * (sensors_.linear_velocity[k] - before[k]),
                  1e-3);
      largest = std::max(largest, std::abs(sensors_.linear_acceleration[k]));
    }
    before = sensors_.linear_velocity;
    EXPECT_EQ(sensors_.gravity, (Vector3{0, 0, -10}));
    EXPECT_EQ(sensors_.gravity, specification().gravity);
  });
  EXPECT_GT(largest, 5);
}

TEST_F(SensorsTest, RangesAreInfiniteWithoutAHit) {
  const RangeFinder& finder = specification().range_finder;
  int infinite = 0;
  int finite = 0;
  walk([&](const std::vector<double>& /*action*/) {
    ASSERT_EQ(sensors_.ranges.size(), finder.num_rays);
    for (std::size_t i = 0; i < finder.num_rays; ++i) {
      // X is forward and Y up in the lidar frame, as in Box2D.
      const double angle = finder.angle_minimum + finder.angle_increment * static_cast<double>(i);
      const b2Vec2 from = hull().GetPosition();
      const b2Vec2 to = from + b2Vec2(static_cast<float>(finder.maximum_range * std::cos(angle)),
                                      static_cast<float>(finder.maximum_range * std::sin(angle)));
      const double fraction = nearest_ground(twin_.physics(), from, to);
      const double observed = walker_.observation[kFirstRay + i];
      if (std::isinf(fraction)) {
        EXPECT_EQ(sensors_.ranges[i], kInfinity);
        EXPECT_EQ(observed, 1.0);
        ++infinite;
      } else {
        EXPECT_NEAR(observed, fraction, 1e-5);
        EXPECT_EQ(sensors_.ranges[i], observed * finder.maximum_range);
        ++finite;
      }
    }
  });
  EXPECT_GT(infinite, 100);
  EXPECT_GT(finite, 100);
}

TEST_F(SensorsTest, ContactsAreTheObservations) {
  int touching[2] = {0, 0};
  walk([this, &touching](const std::vector<double>& /*action*/) {
    for (std::size_t leg = 0; leg < 2; ++leg) {
      const bool touches = walker_.observation[(leg == 0 ? kFirstLeg : kSecondLeg) + 4] != 0;
      EXPECT_EQ(sensors_.contacts[leg] != 0, touches);
      EXPECT_EQ(twin_.physics().leg_touches(leg), touches);
      touching[leg] += touches ? 1 : 0;
    }
  });
  for (const int steps : touching) {
    EXPECT_GT(steps, 10);
    EXPECT_LT(steps, step_ - 10);
  }
}

TEST_F(SensorsTest, SceneIsTheGround) {
  Scene scene;
  walker_.environment->scene(scene);
  const auto& ground = twin_.ground().points;
  ASSERT_EQ(scene.ground.size(), ground.size() - 1);
  ASSERT_EQ(scene.surface_colors.size(), scene.ground.size());
  for (std::size_t i = 0; i < scene.ground.size(); ++i) {
    EXPECT_EQ(scene.ground[i].points[0], (std::array<double, 2>{ground[i].x, ground[i].y}));
    EXPECT_EQ(scene.ground[i].points[1], (std::array<double, 2>{ground[i + 1].x, ground[i + 1].y}));
  }
  EXPECT_EQ(scene.clouds.size(), 10U);
  EXPECT_TRUE(scene.obstacles.empty());
  ASSERT_EQ(scene.flags.size(), 1U);
  EXPECT_EQ(scene.flags[0].z, ground[3].y);
  EXPECT_EQ(scene.flags[0].x, ground[3].x);
}

class SpecificationTest : public SensorsTest {
 protected:
  void SetUp() override {
    SensorsTest::SetUp();
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
