// Pushes and wrenches: they change the momentum, and act where they should.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "pose_algebra.h"
#include "robots/mujoco/model_file.h"
#include "robots/mujoco/other_walker.h"
#include "robots/mujoco/physics.h"
#include "robots/mujoco/player.h"
#include "robots/mujoco/world_robot.h"

namespace walker::mujoco {
namespace {

class WorldPushesTest : public RobotTest {};

/// Horizontal and vertical momentum of the whole robot by finite differences of its links' poses.
std::array<double, 2> momentum(WorldRobot& robot, const std::function<void()>& step) {
  const auto centre = [&robot] {
    Sensors sensors;
    robot.robot->sense(sensors);
    std::array<double, 2> sum{};
    const std::vector<Link>& links = robot.robot->specification().links;
    for (std::size_t i = 0; i < links.size(); ++i) {
      const Pose& pose = sensors.link_poses[i];
      const Vector3 arm = rotated(pose.orientation, links[i].center_of_mass);
      sum[0] += links[i].mass * (pose.position[0] + arm[0]);
      sum[1] += links[i].mass * (pose.position[2] + arm[2]);
    }
    return sum;
  };
  const double dt = robot.robot->specification().dt;
  const std::array<double, 2> before = centre();
  step();
  const std::array<double, 2> after = centre();
  return {(after[0] - before[0]) / dt, (after[1] - before[1]) / dt};
}

/// A push J changes the momentum of the whole robot by J, and of that step only.
TEST_P(WorldPushesTest, APushIsTheChangeOfMomentum) {
  for (const double scale : {1.0, 2.0}) {
    WorldRobot robot = make({{"gravity", 0}, {"mass_scale", scale}});
    robot.reset(0);
    robot.place(flying(robot));
    const auto coast = [&] { robot.step(idle(robot)); };
    // Momentum counts the specification's masses, which are Gymnasium's.
    EXPECT_NEAR(momentum(robot, coast)[0], 0, 1e-10);
    robot.step(idle(robot), {3, -2});
    for (int i = 0; i < 3; ++i) {
      const auto [x, z] = momentum(robot, coast);
      EXPECT_NEAR(scale * x, 3, 1e-3) << i;
      EXPECT_NEAR(scale * z, -2, 1e-3) << i;
    }
    robot.step(idle(robot), {-3, 2});
    const auto [x, z] = momentum(robot, coast);
    EXPECT_NEAR(scale * x, 0, 1e-3);
    EXPECT_NEAR(scale * z, 0, 1e-3);
  }
}

/// A wrench of force F changes the momentum by F dt, on whichever link it acts.
TEST_P(WorldPushesTest, AWrenchIsAChangeOfMomentum) {
  const auto num_links = static_cast<std::uint32_t>(make().robot->specification().links.size());
  for (std::uint32_t link = 0; link < num_links; ++link) {
    WorldRobot robot = make({{"gravity", 0}});
    robot.reset(0);
    robot.place(flying(robot));
    const double dt = robot.robot->specification().dt;
    robot.step(idle(robot), {}, {{link, 3 / dt, -2 / dt, 0}});
    const auto [x, z] = momentum(robot, [&] { robot.step(idle(robot)); });
    EXPECT_NEAR(x, 3, 3e-3) << link;
    EXPECT_NEAR(z, -2, 3e-3) << link;
    robot.step(idle(robot), {}, {{link, 0, 0, 5}});
    const auto [same_x, same_z] = momentum(robot, [&] { robot.step(idle(robot)); });
    EXPECT_NEAR(same_x, x, 2e-2) << "a torque alone, on link " << link;
    EXPECT_NEAR(same_z, z, 2e-2);
  }
}

/// The arm of a force at a link's origin, against mj_applyFT for its generalized force.
TEST_P(WorldPushesTest, AWrenchActsAtTheLinksOrigin) {
  const ModelPointer model =
      load_model(std::string(id()).substr(0, 6) == "Hopper" ? "hopper_v5.xml" : "walker2d_v5.xml");
  for (int body = 1; body < model->nbody; ++body) {
    LibraryPhysics physics(model);
    LibraryPhysics other(model);
    const Numbers position = flying(make());
    const Numbers velocity(model->nv, 0.1);
    for (LibraryPhysics* each : {&physics, &other}) each->reset(position.data(), velocity.data());
    const std::vector<BodyWrench> wrenches{{body, {20, 0, -30}, {0, 4, 0}}};
    ExternalForces forces;
    forces.wrenches = &wrenches;
    const Numbers control(model->nu);
    physics.step(control.data(), forces, 1);
    auto& data = const_cast<mjData&>(other.data());
    mj_kinematics(model.get(), &data);
    mj_comPos(model.get(), &data);
    Numbers generalized(model->nv);
    mj_applyFT(model.get(), &data, wrenches[0].force.data(), wrenches[0].torque.data(),
               data.xpos + 3 * body, body, generalized.data());
    for (int dof = kBaseJoints - 1; dof < model->nv; ++dof) {
      data.qfrc_applied[dof] = generalized[dof];
    }
    other.step(control.data(), {{generalized[kBaseX], generalized[kBaseZ]}}, 1);
    for (int dof = 0; dof < model->nv; ++dof) {
      const double change = physics.velocity()[dof] - velocity[dof];
      EXPECT_NEAR(other.velocity()[dof] - velocity[dof], change, 0.02 * std::abs(change) + 2e-3)
          << "dof " << dof << " under a wrench on body " << body;
    }
  }
}

/// The force acts at the trunk's origin, its centre of mass: the trunk turns only as the limbs make
/// it turn, which a force at the head would not do.
TEST_P(WorldPushesTest, APushActsAtTheTrunksCentreOfMass) {
  EXPECT_EQ(make().robot->specification().links[0].center_of_mass, (Vector3{0, 0, 0}));
}

TEST(UsersModelTest, IsPushed) {
  const Folder folder;
  const std::string file = folder.write("other.xml", other_walker_text());
  const Parameters parameters{{"xml_file", file}, {"healthy_z_range", Numbers{-10, 10}}};
  WorldRobot robot = make_robot(nullptr, "Walker2d-v5", {{"gravity", 0}}, parameters);
  robot.reset(0);
  Numbers position = robot.observation();
  position.resize(kDegreesOfFreedom);
  position[kBaseZ] = 20;
  robot.place(position);
  const auto coast = [&] { robot.step(idle(robot)); };
  robot.step(idle(robot), {3, -2});
  const auto [x, z] = momentum(robot, coast);
  EXPECT_NEAR(x, 3, 0.02);
  EXPECT_NEAR(z, -2, 0.02);
}

INSTANTIATE_TEST_SUITE_P(Robots, WorldPushesTest, testing::ValuesIn(kRobots), name_of);

}  // namespace
}  // namespace walker::mujoco
