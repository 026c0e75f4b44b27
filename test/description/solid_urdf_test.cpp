// Robot descriptions from 3D engines, read by urdfdom: solids, full inertia tensors, and links
// whose frames differ from their joints'. Covers a synthetic body, and Walker2d, whose committed
// description must equal the one that the running environment gives.
#include <gtest/gtest.h>
#include <urdf/model.h>

#include <cmath>
#include <limits>
#include <memory>
#include <string>

#include "description/urdf.h"
#include "description/urdf_geometry.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kTolerance = 1e-14;  // [rad, m], after conversion through roll, pitch and yaw

/// A trunk with every kind of solid and two limbs: one attached at its origin, one rotated.
Specification made_up() {
  Specification specification;
  specification.id = "Test-v0";
  specification.joints_are_exact = true;
  Link trunk;
  trunk.name = "trunk";
  trunk.mass = 1.0 / 3;
  trunk.center_of_mass = {0.1, -0.2, 1.0 / 7};
  trunk.inertia = {0.3, 0.2, 0.25, 0.01, -1.0 / 30, 0.03};
  trunk.color = {0.1, 0.2, 0.3, 0.4};
  const double c = std::sqrt(0.5);
  trunk.solids = {{Solid::Kind::box, {{1, 2, 3}, {0.5, 0.5, 0.5, 0.5}}, {0.1, 0.2, 0.3}},
                  {Solid::Kind::capsule, {{-0.1, 0, 0.1}, {0, -c, 0, c}}, {0.06, 0.1, 0}},
                  {Solid::Kind::cylinder, {{0, 1, 0}, {c, 0, 0, c}}, {0.05, 0.2, 0}},
                  {Solid::Kind::sphere, {{4, 5, 6}, {0, 0, 0, 1}}, {0.7, 0, 0}}};
  Link limb = trunk;
  limb.name = "limb";
  limb.solids.clear();
  Link askew = limb;
  askew.name = "askew";
  specification.links = {trunk, limb, askew};
  const Joint free{"free",     "trunk",   "limb", {0, 0.1, -0.2}, {0, -1, 0},
                   -kInfinity, kInfinity, 100,    kInfinity};
  Joint bent{"bent", "limb", "askew", {0, 0, -0.7}, {0, -1, 0}, -1.0 / 3, 0.5, 40, 3};
  bent.child_frame = {{0.1, 1.0 / 3, -0.25}, {0.5, 0.5, -0.5, 0.5}};
  specification.joints = {free, bent};
  return specification;
}

class MadeUpUrdf : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(model_.initString(make_urdf(specification_, "x").urdf)); }

  Specification specification_ = made_up();
  urdf::Model model_;
};

TEST_F(MadeUpUrdf, HasExactMasses) { expect_masses(specification_, model_, 0); }

TEST_F(MadeUpUrdf, HasTheJointsAndLinkFrames) {
  expect_joints(specification_, model_, 0);
  for (const Joint& joint : specification_.joints) {
    for (const double angle : {0.0, 0.7, -2.5}) {
      const Pose hinge{joint.origin, rotation(joint.axis, angle)};
      expect_same_pose(composed(hinge, joint.child_frame), pose_of_child(model_, joint, angle),
                       kTolerance, joint.name);
    }
  }
  EXPECT_EQ(model_.getJoint("free")->child_link_name, "limb");
  EXPECT_EQ(model_.getJoint("free")->limits->velocity, 10000) << "stands for none";
  EXPECT_EQ(model_.getJoint("bent")->limits->velocity, 3);
  EXPECT_EQ(model_.links_.size(), 4U);
}

TEST_F(MadeUpUrdf, ALinkWithoutShapesIsInvisible) {
  EXPECT_TRUE(model_.getLink("limb")->visual_array.empty());
  EXPECT_TRUE(model_.getLink("limb")->collision_array.empty());
}

TEST_F(MadeUpUrdf, HasEverySolidAsVisualAndCollision) {
  const urdf::LinkConstSharedPtr trunk = model_.getLink("trunk");
  ASSERT_EQ(trunk->visual_array.size(), 6U) << "a capsule is three";
  ASSERT_EQ(trunk->collision_array.size(), 6U);
  EXPECT_EQ(trunk->visual->material->color.r, 0.1F);
  EXPECT_EQ(trunk->visual->material->color.a, 0.4F);
  for (std::size_t i = 0; i < trunk->visual_array.size(); ++i) {
    const urdf::Visual& visual = *trunk->visual_array[i];
    const urdf::Collision& collision = *trunk->collision_array[i];
    EXPECT_EQ(visual.geometry->type, collision.geometry->type);
    expect_same_pose(to_pose(visual.origin), to_pose(collision.origin), kTolerance, "collision");
  }
  const auto expect_origin = [&](std::size_t index, const Pose& pose) {
    expect_same_pose(pose, to_pose(trunk->visual_array[index]->origin), kTolerance,
                     std::to_string(index));
  };
  const auto& box = dynamic_cast<const urdf::Box&>(*trunk->visual_array[0]->geometry);
  expect_near({0.2, 0.4, 0.6}, box.dim, 0, "box");
  expect_origin(0, specification_.links[0].solids[0].pose);
  const auto& body = dynamic_cast<const urdf::Cylinder&>(*trunk->visual_array[1]->geometry);
  EXPECT_EQ(body.radius, 0.06);
  EXPECT_EQ(body.length, 0.2);
  expect_origin(1, specification_.links[0].solids[1].pose);
  // The capsule's z axis points along -x.
  for (const auto& [index, x] : {std::pair<std::size_t, double>{2, -0.2}, {3, 0.0}}) {
    const auto& cap = dynamic_cast<const urdf::Sphere&>(*trunk->visual_array[index]->geometry);
    EXPECT_EQ(cap.radius, 0.06);
    expect_origin(index, {{x, 0, 0.1}});
  }
  const auto& cylinder = dynamic_cast<const urdf::Cylinder&>(*trunk->visual_array[4]->geometry);
  EXPECT_EQ(cylinder.length, 0.4);
  expect_origin(4, specification_.links[0].solids[2].pose);
  EXPECT_EQ(dynamic_cast<const urdf::Sphere&>(*trunk->visual_array[5]->geometry).radius, 0.7);
}

TEST_F(MadeUpUrdf, EscapesNames) {
  specification_.links[1].name = specification_.joints[0].child = "a<b & \"c\"";
  specification_.joints[1].parent = specification_.links[1].name;
  urdf::Model model;
  ASSERT_TRUE(model.initString(make_urdf(specification_, "x").urdf));
  EXPECT_TRUE(model.getLink("a<b & \"c\""));
}

TEST_F(MadeUpUrdf, InventsNoNameInUse) {
  const std::string taken = "askew_hinge";  // the name that the displaced link's hinge would have
  specification_.links[1].name = specification_.joints[0].child = taken;
  specification_.joints[1].parent = taken;
  urdf::Model model;
  ASSERT_TRUE(model.initString(make_urdf(specification_, "x").urdf));
  ASSERT_TRUE(model.getLink(taken) && model.getLink("askew_hinge_hinge"));
  EXPECT_TRUE(model.getLink(taken)->inertial);
  EXPECT_FALSE(model.getLink("askew_hinge_hinge")->inertial);
  // The link with that name would otherwise give its hinge the name of the first link's hinge.
  specification_.joints[0].child_frame = specification_.joints[1].child_frame;
  ASSERT_TRUE(model.initString(make_urdf(specification_, "x").urdf));
  EXPECT_EQ(model.links_.size(), specification_.links.size() + 2);
}

class Walker2dUrdf : public CommittedUrdfTest, public testing::WithParamInterface<std::string> {
 protected:
  Walker2dUrdf() : CommittedUrdfTest("walker2d", GetParam()) {}
};

TEST_P(Walker2dUrdf, EqualsTheGeneratedOne) {
  const UrdfFiles files = make_urdf(specification(), robot_name(GetParam()));
  EXPECT_EQ(without_comment(files.urdf), without_comment(text_));
  EXPECT_TRUE(files.meshes.empty());
  EXPECT_EQ(model_.getName(), "walker2d");
  EXPECT_EQ(model_.getRoot()->name, "torso");
  if (GetParam() == "Walker2d-v5") {
    EXPECT_EQ(files.urdf, text_);
  }
}

INSTANTIATE_TEST_SUITE_P(Versions, Walker2dUrdf, testing::Values("Walker2d-v4", "Walker2d-v5"),
                         [](const testing::TestParamInfo<std::string>& id) {
                           return id.param.substr(id.param.find('v'));
                         });

}  // namespace
}  // namespace walker
