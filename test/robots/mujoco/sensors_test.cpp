// Sensors against a twin in plain MuJoCo, during falls, in random states and for a user's walker.
#include "walker_sim/sensors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "pose_algebra.h"
#include "robots/mujoco/model.h"
#include "robots/mujoco/model_file.h"
#include "robots/mujoco/other_walker.h"
#include "robots/mujoco/plain_walker.h"
#include "robots/mujoco/player.h"
#include "stepper.h"

namespace walker::mujoco {
namespace {

/// With reset noise of 0.5 the first steps are wild; the walker then lies and twitches.
class SensorsTest : public testing::TestWithParam<const char*> {
 protected:
  bool is_other() const { return std::string(GetParam()) == "other"; }

  /// MuJoCo leaves the poses and contacts of the integrator's last stage in mjData. With long time
  /// steps, they are far from the resulting state.
  std::string file() const {
    if (is_other()) return folder_.write("other.xml", other_walker_text());
    if (std::string(GetParam()) != "coarse") return GetParam();
    return folder_.write("coarse.xml", replaced(builtin_text("walker2d_v5.xml"),
                                                "timestep=\"0.002\"", "timestep=\"0.01\""));
  }

  /// Calls `check(action, twin)` after the reset and after every step.
  template <typename Check>
  void walk(Check check) {
    for (const double noise : {5e-3, 0.5}) {
      Parameters parameters = parameters_;
      parameters["reset_noise_scale"] = noise;
      Stepper walker("Walker2d-v5", parameters);
      Actions actions("outside", 3);
      std::vector<double> action(kJointCount, 0);
      walker.reset(4);
      PlainWalker twin(file_);
      twin.set_state(walker.observation);
      walker.environment->sense(sensors_);
      check(action, twin);
      for (int i = 0; i < 200; ++i) {
        SCOPED_TRACE("step " + std::to_string(i));
        actions.draw(walker.observation, action);
        walker.step(action);
        twin.step(action);
        walker.environment->sense(sensors_);
        check(action, twin);
        if (HasFatalFailure()) return;
      }
    }
  }

  /// Height of the lowest point of a link of spheres and capsules in the world [m].
  double lowest_point(const std::string& name) const {
    double lowest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < specification_.links.size(); ++i) {
      if (specification_.links[i].name != name) continue;
      for (const Solid& solid : specification_.links[i].solids) {
        const Pose pose = composed(sensors_.link_poses[i], solid.pose);
        const double half = solid.kind == Solid::Kind::capsule ? solid.size[1] : 0;
        for (const double end : {-half, half}) {
          lowest = std::min(lowest, transformed(pose, {0, 0, end})[2] - solid.size[0]);
        }
      }
    }
    return lowest;
  }

  Folder folder_;
  std::string file_ = file();
  Parameters parameters_{{"xml_file", file_},
                         {"terminate_when_unhealthy", false},
                         {"exclude_current_positions_from_observation", false}};
  std::unique_ptr<Environment> walker_ = make("Walker2d-v5", parameters_);
  const Specification& specification_ = walker_->specification();
  ModelPointer model_ = load_model(file_);
  Sensors sensors_;
};

TEST_P(SensorsTest, JointsEqualTheEngines) {
  walk([this](const std::vector<double>& action, PlainWalker& twin) {
    for (std::size_t i = 0; i < kJointCount; ++i) {
      const Joint& joint = specification_.joints[i];
      const int index = mj_name2id(model_.get(), mjOBJ_JOINT, joint.name.c_str());
      ASSERT_EQ(sensors_.joint_position[i], twin.data().qpos[index]);
      ASSERT_EQ(sensors_.joint_velocity[i], twin.data().qvel[index]);
      const double control =
          std::clamp(action[i], specification_.action_low[i], specification_.action_high[i]);
      ASSERT_NEAR(sensors_.joint_effort[i], control * specification_.effort_per_action[i], 1e-5);
      ASSERT_LE(std::abs(sensors_.joint_effort[i]), joint.maximum_effort + 1e-12);
    }
  });
}

TEST_P(SensorsTest, PosesEqualTheEngines) {
  walk([this](const std::vector<double>& /*action*/, PlainWalker& twin) {
    const mjData& shown = twin.shown();
    for (std::size_t i = 0; i < specification_.links.size(); ++i) {
      const int body = mj_name2id(model_.get(), mjOBJ_BODY, specification_.links[i].name.c_str());
      const mjtNum* const p = at(shown.xpos, body, 3);
      const mjtNum* const q = at(shown.xquat, body, 4);
      ASSERT_EQ(sensors_.link_poses[i].position, (Vector3{p[0], p[1], p[2]}));
      ASSERT_EQ(sensors_.link_poses[i].orientation, (Quaternion{q[1], q[2], q[3], q[0]}));
    }
  });
}

TEST_P(SensorsTest, TrunkVelocitiesEqualTheEngines) {
  Vector3 before{};
  walk([this, &before](const std::vector<double>& /*action*/, PlainWalker& twin) {
    const int trunk = mj_name2id(model_.get(), mjOBJ_BODY, specification_.links[0].name.c_str());
    std::array<mjtNum, 6> motion{};  // angular velocity, then the origin's velocity; world axes
    mj_objectVelocity(model_.get(), &twin.shown(), mjOBJ_XBODY, trunk, motion.data(), 0);
    const bool is_start = twin.data().time == 0;
    for (std::size_t k = 0; k < 3; ++k) {
      ASSERT_NEAR(sensors_.angular_velocity[k], motion[k], 1e-9);
      ASSERT_NEAR(sensors_.linear_velocity[k], motion[k + 3], 1e-9);
      const double mean = (sensors_.linear_velocity[k] - before[k]) / specification_.dt;
      ASSERT_NEAR(sensors_.linear_acceleration[k], is_start ? 0 : mean, 1e-9);
    }
    before = sensors_.linear_velocity;
    EXPECT_EQ(sensors_.gravity, (Vector3{0, 0, -9.81}));
    EXPECT_EQ(sensors_.gravity, specification_.gravity);
  });
}

TEST_P(SensorsTest, ContactsMatchTheFeetsHeight) {
  const double floor = is_other() ? -0.1 : 0;
  std::array<int, 2> seen{};  // lifted, touching
  walk([&](const std::vector<double>& /*action*/, PlainWalker& /*twin*/) {
    ASSERT_EQ(sensors_.contacts.size(), 2U);
    for (std::size_t i = 0; i < 2; ++i) {
      const double lowest = lowest_point(specification_.contact_links[i]);
      ASSERT_NE(lowest, floor);
      ASSERT_EQ(sensors_.contacts[i], lowest < floor ? 1 : 0) << lowest;
      ++seen.at(sensors_.contacts[i]);
    }
  });
  EXPECT_GT(seen[0], 20);
  EXPECT_GT(seen[1], 20);
}

TEST_P(SensorsTest, SensingChangesNothing) {
  Stepper watched("Walker2d-v5", parameters_);
  Stepper alone("Walker2d-v5", parameters_);
  Scene scene;
  std::vector<double> action;
  for (const char* kind : {"saturated", "smooth", "zero"}) {
    Actions actions(kind, 1);
    watched.reset(2);
    alone.reset(2);
    for (int i = 0; i < 300; ++i) {
      watched.environment->sense(sensors_);
      watched.environment->scene(scene);
      watched.environment->sense(sensors_);
      actions.draw(alone.observation, action);
      watched.step(action);
      alone.step(action);
      ASSERT_EQ(watched.row(), alone.row()) << kind << " " << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Walker2d, SensorsTest,
                         testing::Values("walker2d_v4.xml", "walker2d_v5.xml", "other", "coarse"),
                         [](const auto& test) {
                           const std::string name = test.param;
                           return name.substr(0, 8) == "walker2d" ? name.substr(9, 2) : name;
                         });

TEST(Sensors, AreAvailableAfterTheEnd) {
  Stepper walker("Walker2d-v5", {{"max_episode_steps", std::int64_t{3}}});
  Sensors sensors;
  EXPECT_THROW(walker.environment->sense(sensors), ResetNeeded);
  walker.reset(0);
  while (!walker.has_ended()) walker.step({0, 0, 0, 0, 0, 0});
  walker.environment->sense(sensors);
  EXPECT_EQ(sensors.link_poses[0].position[2], walker.observation[0]);
  walker.reset(0);
  walker.environment->sense(sensors);
  EXPECT_EQ(sensors.linear_acceleration, Vector3{}) << "of the last step: there is none";
  EXPECT_EQ(sensors.joint_effort, std::vector<double>(6, 0));
}

}  // namespace
}  // namespace walker::mujoco
