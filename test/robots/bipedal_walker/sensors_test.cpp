// Sensors and scene against the bodies and the ground of a twin during an episode.
#include "walker_sim/sensors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "robots/bipedal_walker/twin_walk.h"

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

class SensorsTest : public TwinWalk {};

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

}  // namespace
}  // namespace walker::bipedal_walker
