// The walkers' specification against MuJoCo's data and numerical integrals.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <regex>
#include <stdexcept>
#include <vector>

#include "base/engine_release.h"
#include "base/random.h"
#include "episode/saved_state.h"
#include "pose_algebra.h"
#include "robots/mujoco/model.h"
#include "robots/mujoco/model_file.h"
#include "robots/mujoco/other_walker.h"
#include "robots/mujoco/player.h"
#include "solid_integral.h"
#include "stepper.h"

namespace walker::mujoco {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kDegree = 3.141592653589793 / 180;

std::array<double, 6> tensor_at_origin(const Link& link) {
  Parts centre;
  centre.add(link.mass, link.center_of_mass);
  const Inertia& inertia = link.inertia;
  std::array<double, 6> tensor{inertia.xx, inertia.yy, inertia.zz,
                               inertia.xy, inertia.xz, inertia.yz};
  for (std::size_t k = 0; k < 6; ++k) tensor[k] += centre.second[k];
  return tensor;
}

/// The built-in walkers, and a user's walker whose frames are all rotated.
class Links : public testing::TestWithParam<const char*> {
 protected:
  bool is_other() const { return std::string(GetParam()) == "other"; }

  Folder folder_;
  std::string file_ =
      is_other() ? folder_.write("other.xml", other_walker_text()) : std::string(GetParam());
  Stepper walker_{
      "Walker2d-v5",
      {{"xml_file", file_}, {"reset_noise_scale", 1.0}, {"terminate_when_unhealthy", false}}};
  const Specification& specification_ = walker_.environment->specification();
};

/// All shapes are solid and have the same density.
TEST_P(Links, HaveTheMassOfTheirShapes) {
  for (const Link& link : specification_.links) {
    SCOPED_TRACE(link.name);
    Parts parts;
    for (const Solid& solid : link.solids) add_solid(solid, is_other() ? 700 : 1000, parts);
    EXPECT_NEAR(parts.mass, link.mass, 2e-3 * link.mass);
    const std::array<double, 6> tensor = tensor_at_origin(link);
    const double trace = tensor[0] + tensor[1] + tensor[2];
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(parts.first[k] / parts.mass, link.center_of_mass[k], 1e-3) << k;
    }
    for (std::size_t k = 0; k < 6; ++k) {
      EXPECT_NEAR(parts.second[k], tensor[k], 2e-3 * trace) << k;
    }
  }
}

/// The links' masses and inertias give the kinetic energy of MuJoCo's mass matrix, up to rounding.
TEST_P(Links, HaveTheEnginesKineticEnergy) {
  const ModelPointer model = load_model(file_);
  const DataPointer data(mj_makeData(model.get()));
  Generator generator(0);
  for (int round = 0; round < 20; ++round) {
    for (int i = 0; i < kDegreesOfFreedom; ++i) {
      data->qpos[i] = generator.uniform(-3, 3);
      data->qvel[i] = generator.uniform(-5, 5);
    }
    mj_forward(model.get(), data.get());
    std::array<mjtNum, kDegreesOfFreedom> momentum{};
    mj_mulM(model.get(), data.get(), momentum.data(), data->qvel);
    double expected = 0;
    for (int i = 0; i < kDegreesOfFreedom; ++i) {
      const double speed = data->qvel[i];
      expected += speed * (momentum[i] - model->dof_armature[i] * speed) / 2;
    }
    double energy = 0;
    for (const Link& link : specification_.links) {
      const int body = mj_name2id(model.get(), mjOBJ_BODY, link.name.c_str());
      std::array<mjtNum, 6> motion{};  // angular velocity, then the origin's velocity; link axes
      mj_objectVelocity(model.get(), data.get(), mjOBJ_XBODY, body, motion.data(), 1);
      const auto [wx, wy, wz, vx, vy, vz] = motion;
      const auto [cx, cy, cz] = link.center_of_mass;
      const double speed =
          std::hypot(vx + wy * cz - wz * cy, vy + wz * cx - wx * cz, vz + wx * cy - wy * cx);
      const Inertia& inertia = link.inertia;
      energy += link.mass * speed * speed / 2 +
                (inertia.xx * wx * wx + inertia.yy * wy * wy + inertia.zz * wz * wz) / 2 +
                inertia.xy * wx * wy + inertia.xz * wx * wz + inertia.yz * wy * wz;
    }
    ASSERT_NEAR(energy / expected, 1, 1e-12) << round;
  }
}

/// Forward kinematics from the specification and the joint angles, in random states.
TEST_P(Links, FollowForwardKinematics) {
  std::map<std::string, std::size_t> index;
  for (std::size_t i = 0; i < specification_.links.size(); ++i) {
    index[specification_.links[i].name] = i;
  }
  ASSERT_EQ(index.size(), 7U);
  EXPECT_TRUE(specification_.joints_are_exact);
  Sensors sensors;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    walker_.reset(seed);
    for (int step = 0; step < 3; ++step) {
      walker_.environment->sense(sensors);
      for (std::size_t i = 0; i < specification_.joints.size(); ++i) {
        const Joint& joint = specification_.joints[i];
        SCOPED_TRACE(joint.name);
        EXPECT_EQ(index.at(joint.child), i + 1) << "links in action order";
        const double angle = sensors.joint_position[i];
        const Pose hinge{joint.origin, rotation(joint.axis, angle)};
        const Pose expected = sensors.link_poses[i + 1];
        const Pose ours = composed(composed(sensors.link_poses[index.at(joint.parent)], hinge),
                                   joint.child_frame);
        for (std::size_t k = 0; k < 3; ++k) {
          ASSERT_NEAR(ours.position[k], expected.position[k], 1e-12);
        }
        ASSERT_NEAR(alignment(ours.orientation, expected.orientation), 1, 1e-12);
      }
      walker_.step({1, -1, 0.5, -0.5, 1, -1});
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Walker2d, Links,
                         testing::Values("walker2d_v4.xml", "walker2d_v5.xml", "other"),
                         [](const auto& test) {
                           const std::string name = test.param;
                           return name == "other" ? name : name.substr(sizeof("walker2d_") - 1, 2);
                         });

class OtherWalker : public testing::Test {
 protected:
  Stepper make_walker(const std::string& text) const {
    return Stepper("Walker2d-v5", {{"xml_file", folder_.write("other.xml", text)}});
  }

  Folder folder_;
};

TEST_F(OtherWalker, HasItsJointsAndLinks) {
  const Stepper walker = make_walker(other_walker_text());
  const Specification& specification = walker.environment->specification();
  struct Expected {
    const char* joint;
    const char* parent;
    const char* child;
    double lower;
    double upper;
    double effort;
  };
  const Expected table[] = {{"knee_left", "upper_left", "lower_left", -kInfinity, kInfinity, 30},
                            {"hip_right", "trunk", "upper_right", -1.2, 0.9, 60},
                            {"ankle_left", "lower_left", "foot_left", -0.5, 0.5, 20},
                            {"hip_left", "trunk", "upper_left", -1.2, 0.9, 50},
                            {"knee_right", "upper_right", "lower_right", -1.5, 0.5, 20},
                            {"ankle_right", "lower_right", "foot_right", -kInfinity, kInfinity, 7}};
  EXPECT_EQ(specification.links[0].name, "trunk");
  for (std::size_t i = 0; i < 6; ++i) {
    SCOPED_TRACE(table[i].joint);
    const Joint& joint = specification.joints[i];
    EXPECT_EQ(joint.name, table[i].joint);
    EXPECT_EQ(joint.parent, table[i].parent);
    EXPECT_EQ(joint.child, table[i].child);
    EXPECT_EQ(specification.links[i + 1].name, table[i].child);
    EXPECT_EQ(joint.lower, table[i].lower);
    EXPECT_EQ(joint.upper, table[i].upper);
    EXPECT_NEAR(joint.maximum_effort, table[i].effort, 1e-12);
    EXPECT_EQ(joint.maximum_velocity, kInfinity);
    EXPECT_NEAR(std::hypot(joint.axis[0], joint.axis[1], joint.axis[2]), 1, 1e-12);
  }
  EXPECT_EQ(specification.contact_links, (std::vector<std::string>{"foot_left", "foot_right"}));
  EXPECT_EQ(specification.links[0].solids.size(), 3U) << "trunk, head and hat";
  EXPECT_EQ(specification.links[0].solids[1].kind, Solid::Kind::sphere);
  EXPECT_EQ(specification.links[0].solids[2].kind, Solid::Kind::cylinder);
  EXPECT_NEAR(specification.links[0].color[2], 0.3, 1e-6);
}

TEST_F(OtherWalker, StandsOnItsPlane) {
  Stepper walker = make_walker(other_walker_text());
  walker.reset(0);
  Scene scene;
  walker.environment->scene(scene);
  ASSERT_TRUE(scene.floor);
  EXPECT_NEAR(scene.floor->z, -0.1, 1e-12) << "the plane of a body that stands still";
}

TEST_F(OtherWalker, CanHaveNoPlane) {
  Stepper walker =
      make_walker(without(other_walker_text(), "<geom name=\"ground\" type=\"plane\"", "/>"));
  walker.reset(0);
  walker.step({0, 0, 0, 0, 0, 0});
  Scene scene;
  walker.environment->scene(scene);
  EXPECT_FALSE(scene.floor);
}

/// The force limit of a motor applies before its gear.
TEST_F(OtherWalker, CanHaveForceLimits) {
  Stepper walker = make_walker(replaced(other_walker_text(), "gainprm=\"5\"",
                                        "gainprm=\"5\" forcelimited=\"true\" forcerange=\"-2 3\""));
  EXPECT_EQ(walker.environment->specification().joints[4].maximum_effort, 12);
  EXPECT_EQ(walker.environment->specification().effort_per_action[4], 20);
  Sensors sensors;
  walker.reset(0);
  walker.step({0, 0, -1, 0, 1, 0});
  walker.environment->sense(sensors);
  EXPECT_EQ(sensors.joint_effort[4], 12);
}

TEST_F(OtherWalker, CanHaveUnnamedBodies) {
  const Stepper walker =
      make_walker(replaced(builtin_text("walker2d_v5.xml"), "<body name=\"thigh\" ", "<body "));
  const Specification& specification = walker.environment->specification();
  EXPECT_EQ(specification.links[1].name, "body_2");
  EXPECT_EQ(specification.joints[0].child, "body_2");
  EXPECT_EQ(specification.joints[1].parent, "body_2");
}

/// Length of a straight leg of capsules, from the hip to the sole [m].
double leg_length(const Specification& specification) {
  const auto half_length = [&](int link) { return specification.links[link].solids[0].size[1]; };
  constexpr int kThigh = 1, kLeg = 2, kFoot = 3;
  return 2 * (half_length(kThigh) + half_length(kLeg)) +
         specification.links[kFoot].solids[0].size[0];
}

/// Spaces, limits and info names: test/python/environment_test.py.
TEST(BuiltInRobots, HaveGymnasiumsLinksAndJoints) {
  struct Expected {
    std::vector<std::string> ids;
    std::vector<std::string> links;
    std::vector<std::string> parents;  ///< by joint
    std::vector<std::string> contact_links;
    double effort;
  };
  const Expected robots[] = {
      {{"Walker2d-v4", "Walker2d-v5"},
       {"torso", "thigh", "leg", "foot", "thigh_left", "leg_left", "foot_left"},
       {"torso", "thigh", "leg", "torso", "thigh_left", "leg_left"},
       {"foot", "foot_left"},
       100},
      {{"Hopper-v4", "Hopper-v5"},
       {"torso", "thigh", "leg", "foot"},
       {"torso", "thigh", "leg"},
       {"foot"},
       200}};
  for (const auto& [ids, links, parents, contact_links, effort] : robots) {
    for (const std::string& id : ids) {
      const auto robot = make(id);
      const Specification& specification = robot->specification();
      EXPECT_EQ(specification.id, id);
      EXPECT_EQ(specification.observation_dtype, "float64");
      EXPECT_EQ(specification.effort_per_action, std::vector<double>(parents.size(), effort));
      EXPECT_EQ(specification.contact_links, contact_links);
      const RangeFinder& finder = specification.range_finder;
      const RangeFinder model = make("BipedalWalker-v3")->specification().range_finder;
      EXPECT_EQ(finder.num_rays, model.num_rays);
      EXPECT_EQ(finder.angle_minimum, model.angle_minimum);
      EXPECT_EQ(finder.angle_increment, model.angle_increment);
      EXPECT_NEAR(finder.maximum_range,
                  model.maximum_range * leg_length(specification) / (68.0 / 30), 1e-12);
      EXPECT_FALSE(finder.is_observed);
      ASSERT_EQ(specification.links.size(), links.size());
      for (std::size_t i = 0; i < links.size(); ++i) {
        EXPECT_EQ(specification.links[i].name, links[i]);
      }
      ASSERT_EQ(specification.joints.size(), parents.size());
      for (std::size_t i = 0; i < parents.size(); ++i) {
        const Joint& joint = specification.joints[i];
        const bool is_foot = i % 3 == 2;
        EXPECT_EQ(joint.name, links[i + 1] + "_joint");
        EXPECT_EQ(joint.parent, parents[i]);
        EXPECT_EQ(joint.child, links[i + 1]);
        EXPECT_EQ(joint.axis, (Vector3{0, -1, 0}));
        EXPECT_NEAR(joint.lower, (is_foot ? -45 : -150) * kDegree, 1e-12);
        EXPECT_NEAR(joint.upper, (is_foot ? 45 : 0) * kDegree, 1e-12);
        EXPECT_EQ(joint.maximum_effort, effort);
      }
    }
  }
}

TEST(BuiltInRobots, StandOnTheFloor) {
  Stepper walker("Walker2d-v5");
  walker.reset(0);
  Scene scene;
  scene.ground.resize(1);  // as another walker could have left it
  walker.environment->scene(scene);
  ASSERT_TRUE(scene.floor);
  EXPECT_EQ(scene.floor->z, 0);
  EXPECT_GT(scene.floor->tile, 0);
  EXPECT_NE(scene.floor->colors[0], scene.floor->colors[1]);
  EXPECT_TRUE(scene.ground.empty());
}

TEST(BuiltInRobots, NameTheEngine) {
  namespace fs = std::filesystem;
  const auto walker = make("Walker2d-v5");
  const Specification& specification = walker->specification();
  EXPECT_EQ(specification.engine, "MuJoCo");
  EXPECT_EQ(specification.engine_version.rfind("2.2.2 (", 0), 0U) << specification.engine_version;
  ASSERT_TRUE(fs::exists(specification.engine_path)) << specification.engine_path;
  EXPECT_NE(specification.engine_path.find("libmujoco"), std::string::npos);
  EXPECT_NE(specification.engine_version.find("pinned"), std::string::npos);
}

TEST(Libm, IsPartOfTheEngineVersion) {
  const std::regex variant("fma|no fma|[0-9a-f]{16}");
  for (const Registration& registration : registrations()) {
    const auto walker = make(registration.id);
    const Specification& specification = walker->specification();
    EXPECT_EQ(std::regex_match(variant_of(specification.engine_version, kLibm), variant),
              specification.engine == "MuJoCo")
        << specification.engine_version;
  }
}

TEST(Libm, DoesNotAffectSavedStates) {
  Specification specification = make("Walker2d-v5")->specification();
  std::vector<std::byte> state;
  const std::size_t begin = StateOrigin(specification).begin(state);
  StateOrigin::seal(state, begin);
  specification.engine_version =
      engine_release(specification.engine_version) + kLibm + "another" + kSteppedBy + "hand";
  EXPECT_NO_THROW(StateOrigin(specification).open(state.data(), state.size()));
  specification.engine_version = "9" + specification.engine_version;
  EXPECT_THROW(StateOrigin(specification).open(state.data(), state.size()), std::invalid_argument);
}

}  // namespace
}  // namespace walker::mujoco
