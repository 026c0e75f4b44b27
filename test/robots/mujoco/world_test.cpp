// Walkers in worlds: physics, pushes, levels, noise.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "bits.h"
#include "kernel_variable.h"
#include "observer.h"
#include "robots/mujoco/model_file.h"
#include "robots/mujoco/other_walker.h"
#include "robots/mujoco/physics.h"
#include "robots/mujoco/planar_model.h"
#include "robots/mujoco/player.h"
#include "robots/mujoco/random_level.h"
#include "robots/mujoco/world_robot.h"
#include "test_name.h"

namespace walker::mujoco {
namespace {

using Numbers = std::vector<double>;

constexpr double kGravity = -9.81;

/// A robot that shows all of its state, stepped by the kernel of this name.
WorldRobot make_robot(const char* kernel, const std::string& id, const WorldValues& world = {},
                      Parameters parameters = {}) {
  const KernelVariable variable(kernel);
  parameters["exclude_current_positions_from_observation"] = false;
  parameters["include_lidar_in_observation"] = true;
  parameters["terminate_when_unhealthy"] = false;
  return WorldRobot(id, parameters, world);
}

/// Bent joints in the air, away from limits and contacts.
Numbers flying(const WorldRobot& robot) {
  Numbers position(kBaseJoints + robot.action_size(), -0.3);
  position[kBaseX] = 0.1;
  position[kBaseZ] = 20;
  position[kBasePitch] = 0.2;
  return position;
}

double velocity_of(const WorldRobot& robot, int dof) {
  return robot.observation()[kBaseJoints + robot.action_size() + dof];
}

Numbers idle(const WorldRobot& robot) { return Numbers(robot.action_size()); }

Numbers row(const WorldRobot& robot) {
  Numbers numbers = robot.observation();
  numbers.push_back(robot.result.reward);
  numbers.insert(numbers.end(), robot.info.begin(), robot.info.end());
  return numbers;
}

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

/// Returns the height of the upper side of ground and obstacles at x.
double height_in(const Scene& scene, double x) {
  double height = -1e9;
  const auto see = [&](const std::array<double, 2>& from, const std::array<double, 2>& to) {
    if (from[0] > x || to[0] < x || from[0] == to[0]) return;
    height = std::max(height, from[1] + (x - from[0]) / (to[0] - from[0]) * (to[1] - from[1]));
  };
  for (const ScenePolygon& ground : scene.ground) see(ground.points[0], ground.points[1]);
  for (const ScenePolygon& box : scene.obstacles) see(box.points[3], box.points[2]);
  return height;
}

class RobotTest : public testing::TestWithParam<std::tuple<const char*, const char*>> {
 protected:
  static const char* id() { return std::get<0>(GetParam()); }

  static WorldRobot make(const WorldValues& world = {}, const Parameters& parameters = {}) {
    return make_robot(std::get<1>(GetParam()), id(), world, parameters);
  }
};

TEST_P(RobotTest, FallsFreelyUnderTheWorldsGravity) {
  for (const double gravity : {kGravity, 0.0, -1.62, -50.0}) {
    WorldRobot robot = make({{"gravity", gravity}});
    robot.reset(0);
    robot.place(flying(robot));
    for (int i = 0; i < 10; ++i) {
      const double before = velocity_of(robot, kBaseZ);
      robot.step(idle(robot));
      const double expected = gravity * robot.robot->specification().dt;
      // The observed velocity is limited to 10 m/s, and its rounding grows with it.
      if (before + expected < -10) break;
      EXPECT_NEAR(velocity_of(robot, kBaseZ) - before, expected, 1e-12 * (1 - gravity)) << i;
      EXPECT_NEAR(velocity_of(robot, kBaseX), 0, 1e-12);
      EXPECT_NEAR(velocity_of(robot, kBasePitch), 0, 1e-12);
    }
    Sensors sensors;
    robot.robot->sense(sensors);
    EXPECT_EQ(sensors.gravity, (Vector3{0, 0, gravity}));
    EXPECT_EQ(robot.robot->specification().gravity, (Vector3{0, 0, kGravity}));
  }
}

/// A push J changes the momentum of the whole robot by J, and of that step only.
TEST_P(RobotTest, APushIsTheChangeOfMomentum) {
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
TEST_P(RobotTest, AWrenchIsAChangeOfMomentum) {
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
TEST_P(RobotTest, AWrenchActsAtTheLinksOrigin) {
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
TEST_P(RobotTest, APushActsAtTheTrunksCentreOfMass) {
  EXPECT_EQ(make().robot->specification().links[0].center_of_mass, (Vector3{0, 0, 0}));
}

/// Values that are Gymnasium's change no bit, and another world leaves nothing behind.
TEST_P(RobotTest, GymnasiumsValuesGiveGymnasiumsBits) {
  WorldValues defaults;
  for (const WorldParameter& parameter : find_registration(id()).world_parameters) {
    if (!std::isnan(parameter.default_value)) defaults[parameter.name] = parameter.default_value;
  }
  WorldRobot plain = make();
  WorldRobot named = make(defaults);
  WorldRobot former = make({{"gravity", -3}, {"mass_scale", 2}, {"joint_damping", 5}});
  WorldRobot climber = make({{"ground_roughness", 3}, {"stair_height", 0.2}});
  for (WorldRobot* robot : {&former, &climber}) {
    robot->reset(1);
    robot->step(idle(*robot), {5, 5});
    robot->robot->set_world({});
  }
  Actions actions("random", 1, static_cast<int>(plain.action_size()));
  Numbers action;
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    for (WorldRobot* robot : {&plain, &named, &former, &climber}) robot->reset(seed);
    for (int i = 0; i < 60; ++i) {
      actions.draw(plain.observation(), action);
      for (WorldRobot* robot : {&plain, &named, &former, &climber}) robot->step(action);
      ASSERT_EQ(to_bits(row(climber)), to_bits(row(plain)));
      ASSERT_EQ(to_bits(row(named)), to_bits(row(plain)));
      ASSERT_EQ(to_bits(row(former)), to_bits(row(plain)));
    }
  }
}

/// The physics' limits, all of their combinations, from wild starts.
TEST_P(RobotTest, IsStableAtTheLimits) {
  std::vector<WorldParameter> parameters = find_registration(id()).world_parameters;
  const auto is_other = [](const WorldParameter& parameter) {
    const std::vector<WorldParameter> levels = level_parameters();
    return parameter.name == "lidar_range" || parameter.name == "range_noise" ||
           std::any_of(levels.begin(), levels.end(),
                       [&](const WorldParameter& level) { return level.name == parameter.name; });
  };
  parameters.erase(std::remove_if(parameters.begin(), parameters.end(), is_other),
                   parameters.end());
  ASSERT_EQ(parameters.front().name, "gravity");
  for (unsigned corner = 0; corner < 1U << parameters.size(); ++corner) {
    WorldValues world;
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      const WorldParameter& parameter = parameters[i];
      world[parameter.name] = (corner >> i & 1U) != 0 ? parameter.maximum : parameter.minimum;
    }
    WorldRobot robot = make(world, {{"reset_noise_scale", 0.1}});
    Actions actions("saturated", corner, static_cast<int>(robot.action_size()));
    Numbers action;
    for (std::uint64_t seed = 0; seed < 2; ++seed) {
      robot.reset(seed);
      for (int i = 0; i < 100; ++i) {
        actions.draw(robot.observation(), action);
        ASSERT_NO_THROW(robot.step(action)) << "corner " << corner;
        for (const double value : robot.observation()) {
          ASSERT_TRUE(std::isfinite(value)) << "corner " << corner;
        }
      }
    }
  }
}

/// Random actions from all along the ground, in levels at each parameter's limits and between.
TEST_P(RobotTest, IsStableInLevels) {
  Generator random(7);
  std::vector<WorldValues> levels;
  for (const WorldParameter& parameter : level_parameters()) {
    for (const double value : {parameter.minimum, parameter.maximum}) {
      levels.push_back({{parameter.name, value}});
      if (parameter.name == "obstacle_spacing") {
        levels.back()["stump_height"] = 0.2;
        levels.push_back({{parameter.name, value}, {"pit_gap", 0.5}});
      }
    }
  }
  for (int i = 0; i < 40; ++i) levels.push_back(random_level(random));
  WorldRobot robot = make();
  Numbers action(robot.action_size());
  for (const WorldValues& level : levels) {
    SCOPED_TRACE(to_string(as_numbers(level)));
    robot.robot->set_world(level);
    for (std::uint64_t seed = 0; seed < 4; ++seed) {
      robot.reset(seed);
      Scene scene;
      robot.robot->scene(scene);
      for (int i = 0; i < 100; ++i) {
        if (i % 50 == 25 && level_of(level)) {
          Numbers place(kBaseJoints + robot.action_size());
          place[kBaseX] = random.uniform(0, 100);
          place[kBaseZ] = 1.3 + height_in(scene, place[kBaseX]);
          robot.place(place);
        }
        for (double& value : action) value = random.uniform(-1, 1);
        ASSERT_NO_THROW(robot.step(action, {random.uniform(-5, 10), random.uniform(-5, 10)}));
        for (const double value : robot.observation()) ASSERT_TRUE(std::isfinite(value));
      }
    }
  }
}

/// A walker over a pit falls until its torso is too low above the rims.
TEST_P(RobotTest, APitEndsTheEpisode) {
  const KernelVariable variable(std::get<1>(GetParam()));
  WorldRobot robot(id(), {{"exclude_current_positions_from_observation", false}}, {{"pit_gap", 2}});
  WorldRobot endless = make({{"pit_gap", 2}});
  const bool is_hopper = std::string(id()).find("Hopper") == 0;
  const double limit = is_hopper ? 0.7 : 0.8;
  for (WorldRobot* each : {&robot, &endless}) {
    each->reset(1);
    Numbers over(kBaseJoints + each->action_size());
    over[kBaseX] = 3.2;
    over[kBaseZ] = 1.25;
    each->place(over);
  }
  for (int i = 0; i < 100 && !robot.result.terminated; ++i) {
    EXPECT_GT(robot.observation()[kBaseZ], limit);
    robot.step(idle(robot));
  }
  ASSERT_TRUE(robot.result.terminated);
  EXPECT_EQ(robot.result.end_reason, std::string("the torso's height left healthy_z_range"));
  EXPECT_LT(robot.observation()[kBaseZ], limit);
  for (int i = 0; i < 300; ++i) endless.step(idle(endless));
  EXPECT_GT(endless.observation()[kBaseZ], -0.9) << "a pit has a bottom";
  EXPECT_LT(endless.observation()[kBaseZ], 0.4);
}

/// Health is measured from the ground below: a tread far up or down is healthy ground.
TEST_P(RobotTest, HealthIsMeasuredFromTheGround) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    WorldRobot robot = make({{"stair_height", 0.5}, {"stair_steps", 9}, {"stair_width", 1}});
    robot.reset(seed);
    Scene scene;
    robot.robot->scene(scene);
    for (double x = 2.5; x < 60; x += 1.7) {
      const double height = height_in(scene, x);
      Numbers place(kBaseJoints + robot.action_size());
      place[kBaseX] = x;
      place[kBaseZ] = height + 1.25;
      robot.place(place);
      EXPECT_EQ(robot.robot->is_healthy(), true) << x << " " << height;
      place[kBaseZ] = height + 0.65;
      robot.place(place);
      EXPECT_EQ(robot.robot->is_healthy(), false);
    }
  }
}

SensorNoise draw_noise(Generator& random, std::size_t joints) {
  SensorNoise noise;
  const auto draw = [&random] { return random.uniform(-0.2, 0.2); };
  for (std::size_t i = 0; i < joints; ++i) {
    noise.joint_position.push_back(draw());
    noise.joint_velocity.push_back(draw());
  }
  noise.pitch = draw();
  noise.angular_velocity = draw();
  noise.linear_velocity = {draw(), draw()};
  for (int i = 0; i < 10; ++i) noise.ranges.push_back(5 * draw());
  return noise;
}

/// A noisy observation is what a builder makes of noisy sensors, also where velocities are clamped.
void expect_builders_observations(const std::string& id, Parameters parameters) {
  parameters["terminate_when_unhealthy"] = false;
  for (const auto& [exclude, include] : {std::pair(true, false), {false, true}}) {
    parameters["exclude_current_positions_from_observation"] = exclude;
    parameters["include_lidar_in_observation"] = include;
    WorldRobot robot(id, parameters, {{"gravity", -5}, {"lidar_range", 3}});
    const auto builder = make_observation_builder(id, parameters);
    Generator random(1);
    Actions actions("random", 1, static_cast<int>(robot.action_size()));
    Numbers action;
    int num_clamped = 0;
    robot.reset(1);
    builder->reset();
    for (int i = 0; i < 200; ++i) {
      const SensorNoise noise = draw_noise(random, robot.action_size());
      Sensors sensors;
      robot.robot->sense(sensors);
      add(noise, sensors);
      const Numbers observation = robot.observation(noise);
      Numbers built(observation.size());
      Measurements measurements = measurements_of(sensors);
      measurements.maximum_range = sensors.maximum_range;
      builder->build(measurements, built.data());
      const std::size_t state_size = built.size() - (include ? 10 : 0);
      for (std::size_t k = 0; k < built.size(); ++k) {
        ASSERT_NEAR(observation[k], built[k], k < state_size ? 1e-12 : 1.2e-7)
            << id << ", step " << i << ", value " << k;
        num_clamped += std::abs(observation[k]) == 10 ? 1 : 0;
      }
      ASSERT_NE(observation, robot.observation());
      actions.draw(observation, action);
      robot.step(action, {i % 10 == 0 ? 30.0 : 0.0, 0});
    }
    EXPECT_GT(num_clamped, 5) << id;
  }
}

TEST_P(RobotTest, ANoisyObservationIsThatOfNoisySensors) {
  expect_builders_observations(id(), {{"reset_noise_scale", 0.1}});
}

TEST_P(RobotTest, NoNoiseIsNoNoise) {
  WorldRobot robot = make();
  robot.reset(2);
  SensorNoise none;
  none.joint_position.resize(robot.action_size());
  none.joint_velocity.resize(robot.action_size());
  EXPECT_EQ(robot.observation(none), robot.observation());
}

std::string name_of(const testing::TestParamInfo<RobotTest::ParamType>& info) {
  const auto [id, kernel] = info.param;
  return test_name(id) + (kernel == nullptr ? "" : std::string("_") + kernel);
}

INSTANTIATE_TEST_SUITE_P(Walker2d, RobotTest,
                         testing::Combine(testing::Values("Walker2d-v4", "Walker2d-v5"),
                                          testing::Values(nullptr, "sse2", "off")),
                         name_of);
INSTANTIATE_TEST_SUITE_P(Hopper, RobotTest,
                         testing::Combine(testing::Values("Hopper-v4", "Hopper-v5"),
                                          testing::Values(nullptr)),
                         name_of);

/// The sensors' effort is the motor's, with its strength.
TEST(WorldModelTest, MotorStrengthScalesTheEffort) {
  for (const auto& [id, effort] : {std::pair("Walker2d-v4", 100.0), {"Hopper-v4", 200.0}}) {
    WorldRobot robot = make_robot(nullptr, id, {{"motor_strength", 0.3}});
    robot.reset(0);
    robot.step(Numbers(robot.action_size(), 0.5));
    Sensors sensors;
    robot.robot->sense(sensors);
    for (const double value : sensors.joint_effort) EXPECT_NEAR(value, 0.15 * effort, 1e-12);
  }
}

/// A user's model keeps its own numbers where the world names none.
TEST(WorldModelTest, AUsersModelTakesWorlds) {
  const Folder folder;
  const std::string file = folder.write("other.xml", other_walker_text());
  const Parameters parameters{{"xml_file", file}, {"healthy_z_range", Numbers{-10, 10}}};
  expect_builders_observations("Walker2d-v5", parameters);
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

}  // namespace
}  // namespace walker::mujoco
