// The description puts every link where the engine has its body: compares the chain of joints at
// the measured angles with the bodies' poses. The server's transforms equal the description's, and
// URDF's angles read back as the rotations.
#include <gtest/gtest.h>
#include <urdf/model.h>

#include <cmath>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "description/urdf.h"
#include "description/urdf_geometry.h"
#include "server/topics/converters.h"
#include "stepper.h"
#include "temporary_folder.h"

namespace walker {
namespace {

constexpr double kTolerance = 1e-13;  // [m], also at 1 m from a link's origin

/// Expects one message with one stamp for all moving links, and the description's kinematics.
void expect_transforms_of(const urdf::Model& model, const Specification& specification,
                          const Sensors& sensors) {
  const Frames frames(specification, "robot");
  const ros::Time stamp(1, 2);
  tf2_msgs::TFMessage state;
  to_message(specification, sensors, frames, stamp, state);
  std::size_t hinges = 0;
  std::map<std::string, double> angles;
  for (std::size_t i = 0; i < specification.joints.size(); ++i) {
    angles[specification.joints[i].name] = sensors.joint_position[i];
    hinges += is_identity(specification.joints[i].child_frame) ? 0 : 1;
  }
  ASSERT_EQ(state.transforms.size(), 2 + angles.size()) << "the trunk, a link per joint and lidar";
  for (const auto& transform : state.transforms) EXPECT_EQ(transform.header.stamp, stamp);
  ASSERT_EQ(model.links_.size(), specification.links.size() + hinges);
  expect_the_kinematics_of(model, "robot/", angles, state,
                           static_transforms(specification, frames, stamp), kTolerance);
}

/// Takes random actions until after the fall, and compares at each step.
void expect_poses_of_the_engine(const std::string& id, Parameters parameters) {
  parameters["terminate_when_unhealthy"] = false;
  Stepper stepper(id, parameters);
  const Specification& specification = stepper.environment->specification();
  urdf::Model model;
  ASSERT_TRUE(model.initString(make_urdf(specification, "walker").urdf));
  std::mt19937 draws(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Sensors sensors;
  stepper.reset(1);
  for (int step = 0; step < 300; ++step) {
    stepper.environment->sense(sensors);
    const std::function<Pose(const std::string&)> pose_of = [&](const std::string& link) {
      for (std::size_t i = 0; i < specification.joints.size(); ++i) {
        const Joint& joint = specification.joints[i];
        if (joint.child != link) continue;
        return composed(pose_of(joint.parent),
                        pose_of_child(model, joint, sensors.joint_position[i]));
      }
      return sensors.link_poses[0];
    };
    for (std::size_t i = 0; i < specification.links.size(); ++i) {
      const std::string& link = specification.links[i].name;
      expect_same_pose(sensors.link_poses[i], pose_of(link), kTolerance, link);
    }
    expect_transforms_of(model, specification, sensors);
    if (testing::Test::HasFailure()) return;
    std::vector<double> action(specification.action_size());
    for (double& value : action) value = uniform(draws);
    stepper.step(action);
  }
}

TEST(UrdfKinematics, EqualTheEnginesForWalker2d) {
  expect_poses_of_the_engine("Walker2d-v4", {});
  expect_poses_of_the_engine("Walker2d-v5", {});
}

/// A user's model: rotated and displaced bodies, bodies without a joint, nonzero reference angles.
TEST(UrdfKinematics, EqualTheEnginesForAUsersModel) {
  std::string text = read_source("assets/walker2d_v5.xml");
  for (const auto& [old, changed] : std::vector<std::pair<std::string, std::string>>{
           {"<body name=\"thigh\" pos", "<body name=\"thigh\" euler=\"0 20 0\" pos"},
           {"<body name=\"leg_left\" pos", "<body name=\"shin &amp; co\" euler=\"0 -35 0\" pos"},
           {"<joint name=\"leg_joint\" pos=\"0 0 0.25\"",
            "<joint name=\"leg_joint\" pos=\"0.03 0.01 0.2\" ref=\"-30\""},
           {"<joint name=\"foot_joint\" pos", "<joint name=\"foot_joint\" axis=\"0 1 0\" pos"},
           {"<body name=\"thigh_left\" pos",
            "<body name=\"hip\" pos=\"0.02 0.1 0\" euler=\"5 10 0\"/>\n"
            "<body name=\"pelvis\" pos=\"0 -0.1 0\" euler=\"0 7 0\"><body name=\"thigh_left\" pos"},
           {"</body>\n    </body>\n  </worldbody>", "</body></body></body></worldbody>"},
           // The actuators define the order of the actions.
           {"<motor joint=\"thigh_joint\"/>", "<motor joint=\"foot_joint\"/>"},
           {"<motor joint=\"foot_joint\"/>\n    <motor joint=\"thigh_left",
            "<motor joint=\"thigh_joint\"/>\n    <motor joint=\"thigh_left"}}) {
    const std::size_t place = text.find(old);
    ASSERT_NE(place, std::string::npos) << old;
    text.replace(place, old.size(), changed);
  }
  const Folder folder;
  expect_poses_of_the_engine("Walker2d-v5", {{"xml_file", folder.write("walker.xml", text)}});
}

/// Box2D's joints are compliant, so the poses are the bodies'; sensors_test compares them.
TEST(UrdfKinematics, HaveTheTreeOfBipedalWalkersTransforms) {
  Stepper stepper("BipedalWalker-v3", {});
  const Specification& specification = stepper.environment->specification();
  urdf::Model model;
  ASSERT_TRUE(model.initString(make_urdf(specification, "walker").urdf));
  Sensors sensors;
  stepper.reset(1);
  stepper.environment->sense(sensors);
  const Frames frames(specification, "");
  tf2_msgs::TFMessage state;
  to_message(specification, sensors, frames, ros::Time(1), state);
  expect_the_tree_of(model, "", state, static_transforms(specification, frames, ros::Time(1)));
  EXPECT_EQ(state.transforms.size(), model.links_.size() + 1) << "the links and lidar";
}

TEST(RollPitchYaw, ReadsBackAsTheSameRotation) {
  const double quarter = std::sqrt(0.5);
  std::vector<Quaternion> rotations{{0, 0, 0, 1},
                                    {0, 0, 1, 0},
                                    {0, quarter, 0, quarter},
                                    {0, -quarter, 0, quarter},
                                    {-0.5, -0.5, -0.5, 0.5},
                                    {0.5, -0.5, 0.5, 0.5}};
  std::mt19937 draws(1);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector4d q(normal(draws), normal(draws), normal(draws), normal(draws));
    const Eigen::Vector4d unit = q.normalized();
    rotations.push_back({unit[0], unit[1], unit[2], unit[3]});
  }
  for (const Quaternion& q : rotations) {
    const Vector3 angles = roll_pitch_yaw(q);
    urdf::Pose read;
    read.rotation.setFromRPY(angles[0], angles[1], angles[2]);
    expect_same_pose({{0, 0, 0}, q}, to_pose(read), 1e-14, "rotation");
  }
}

TEST(RollPitchYaw, HasNoYawInGimbalLock) {
  const double quarter = std::sqrt(0.5);
  EXPECT_EQ(roll_pitch_yaw({0, -quarter, 0, quarter})[2], 0);
  EXPECT_EQ(roll_pitch_yaw({-0.5, -0.5, -0.5, 0.5})[2], 0);
}

TEST(Poses, AreTheIdentityExactly) {
  EXPECT_TRUE(is_identity(Pose{}));
  EXPECT_FALSE(is_identity({{0, 0, 1e-300}, {0, 0, 0, 1}}));
  EXPECT_FALSE(is_identity({{0, 0, 0}, {0, 1, 0, 0}}));
}

}  // namespace
}  // namespace walker
