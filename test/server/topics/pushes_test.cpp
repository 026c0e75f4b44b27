#include "server/topics/converters.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "base/limits.h"
#include "error_message.h"

namespace walker {
namespace {

class LinkWrenchTest : public testing::Test {
 protected:
  LinkWrenchTest() {
    message_.header.frame_id = "robot/shin";
    specification_.links.resize(2);
    specification_.links[0].name = "hull";
    specification_.links[1].name = "shin";
    sensors_.link_poses.resize(2);
    // A rotation about y by 90 degrees turns the link's x to -z of the world, and its z to x.
    sensors_.link_poses[1].orientation = {0, std::sqrt(0.5), 0, std::sqrt(0.5)};
  }

  LinkWrench converted() const {
    return to_link_wrench(message_, Frames(specification_, "robot"), sensors_);
  }
  std::string refusal() const {
    return message_of<std::invalid_argument>([this] { converted(); });
  }

  Specification specification_;
  Sensors sensors_;
  geometry_msgs::WrenchStamped message_;
};

TEST_F(LinkWrenchTest, IsTurnedFromTheLinksFrameIntoTheWorld) {
  message_.wrench.force.x = 3;
  message_.wrench.force.z = 5;
  message_.wrench.torque.y = -2;
  const LinkWrench wrench = converted();
  EXPECT_EQ(wrench.link, 1U);
  EXPECT_NEAR(wrench.force_x, 5, 1e-12);
  EXPECT_NEAR(wrench.force_z, -3, 1e-12);
  EXPECT_NEAR(wrench.torque_y, -2, 1e-12);
  message_.header.frame_id = "robot/hull";
  EXPECT_EQ(converted().link, 0U);
  EXPECT_EQ(converted().force_x, 3);
  EXPECT_EQ(converted().force_z, 5);
}

TEST_F(LinkWrenchTest, AnotherFrameIsNoLink) {
  for (const char* frame : {"", "shin", "odom", "robot/odom", "/robot/shin"}) {
    message_.header.frame_id = frame;
    EXPECT_EQ(refusal().rfind(std::string("frame_id ") + frame, 0), 0U) << refusal();
    EXPECT_NE(refusal().find("robot/shin"), std::string::npos) << refusal();
  }
}

TEST_F(LinkWrenchTest, BaseLinkIsTheTrunk) {
  message_.header.frame_id = "robot/base_link";
  message_.wrench.force.x = 3;
  EXPECT_EQ(converted().link, 0U);
  EXPECT_EQ(converted().force_x, 3);
}

/// The limit holds in the link's axes, here turned by 45 degrees, and the episode takes the result.
TEST_F(LinkWrenchTest, ComponentsAreLimited) {
  sensors_.link_poses[1].orientation = {0, std::sin(M_PI / 8), 0, std::cos(M_PI / 8)};
  message_.wrench.force.x = kMaxPush;
  message_.wrench.force.z = kMaxPush;
  message_.wrench.torque.y = -kMaxPush;
  EXPECT_NEAR(converted().force_x, std::sqrt(2) * kMaxPush, 1e-6);
  EXPECT_LT(converted().force_x, kMaxTurnedPush);
  message_.wrench.force.z = 0;
  message_.wrench.force.x = 1.2 * kMaxPush;
  EXPECT_EQ(refusal(), "force.x = 1200000 N; must be in [-1000000, 1000000]");
}

TEST_F(LinkWrenchTest, ComponentsAreFinite) {
  message_.wrench.force.y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refusal().rfind("force.y = nan N", 0), 0U) << refusal();
  message_.wrench.force.y = 0;
  message_.wrench.torque.x = std::numeric_limits<double>::infinity();
  EXPECT_EQ(refusal().rfind("torque.x = inf N m", 0), 0U) << refusal();
}

TEST_F(LinkWrenchTest, NothingPushesOutOfThePlaneOfMotion) {
  message_.wrench.force.y = 3;
  EXPECT_EQ(refusal(),
            "force acts with 3 N out of the walker's plane of motion (x and z of odom); must be 0");
  message_.wrench.force.x = kMaxPush;
  message_.wrench.force.y = 1;  // the rounding of a rotation
  EXPECT_EQ(converted().link, 1U);
  message_.wrench.force = {};
  message_.header.frame_id = "robot/hull";
  message_.wrench.torque.z = -4;
  EXPECT_EQ(refusal().rfind("torque acts with 4 N m out of the walker's plane", 0), 0U)
      << refusal();
}

}  // namespace
}  // namespace walker
