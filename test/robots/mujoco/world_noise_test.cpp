// Noise of worlds: an observation is that of noisy sensors.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "observer.h"
#include "robots/mujoco/model_file.h"
#include "robots/mujoco/other_walker.h"
#include "robots/mujoco/player.h"
#include "robots/mujoco/world_robot.h"

namespace walker::mujoco {
namespace {

class WorldNoiseTest : public RobotTest {};

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

TEST_P(WorldNoiseTest, ANoisyObservationIsThatOfNoisySensors) {
  expect_builders_observations(id(), {{"reset_noise_scale", 0.1}});
}

TEST_P(WorldNoiseTest, NoNoiseIsNoNoise) {
  WorldRobot robot = make();
  robot.reset(2);
  SensorNoise none;
  none.joint_position.resize(robot.action_size());
  none.joint_velocity.resize(robot.action_size());
  EXPECT_EQ(robot.observation(none), robot.observation());
}

TEST(UsersModelTest, HasNoisySensors) {
  const Folder folder;
  const std::string file = folder.write("other.xml", other_walker_text());
  expect_builders_observations("Walker2d-v5",
                               {{"xml_file", file}, {"healthy_z_range", Numbers{-10, 10}}});
}

INSTANTIATE_TEST_SUITE_P(Robots, WorldNoiseTest, testing::ValuesIn(kRobots), name_of);

}  // namespace
}  // namespace walker::mujoco
