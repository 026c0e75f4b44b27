// Resets, steps and sensing allocate nothing by operator new; MuJoCo allocates by malloc.
#include <gtest/gtest.h>

#include "allocation_counter.h"
#include "robots/mujoco/player.h"
#include "robots/mujoco/world_robot.h"
#include "stepper.h"

namespace walker::mujoco {
namespace {

TEST_F(AllocationTest, ResetsStepsAndSensesWithoutTheHeap) {
  for (const char* id : {"Walker2d-v4", "Walker2d-v5", "Hopper-v5"}) {
    Stepper walker(id, {{"include_lidar_in_observation", std::string(id) == "Walker2d-v5"}});
    Sensors sensors;
    std::vector<double> action(walker.environment->specification().action_size());
    Actions actions("balance", 0, static_cast<int>(action.size()));
    walker.reset(0);
    walker.environment->sense(sensors);  // sizes the vectors
    int resets = 0;
    int steps = 0;
    const Counting counting;
    for (; steps < 2000; ++steps) {
      if (walker.has_ended()) {
        walker.reset(resets % 2 == 0 ? std::optional<std::uint64_t>(steps) : std::nullopt);
        walker.environment->sense(sensors);
        ++resets;
      }
      actions.draw(walker.observation, action);
      walker.step(action);
      walker.environment->sense(sensors);
    }
    EXPECT_EQ(allocations, 0) << id << " in " << steps << " steps and " << resets << " resets";
    EXPECT_GT(resets, 3);
  }
}

TEST_F(AllocationTest, StepsInAWorldWithoutTheHeap) {
  for (const char* id : {"Walker2d-v5", "Hopper-v5"}) {
    WorldRobot robot(id,
                     {{"terminate_when_unhealthy", false}, {"include_lidar_in_observation", true}},
                     {{"mass_scale", 2}, {"gravity", -5}, {"friction_scale", 0.5}});
    std::vector<double> observation(robot.robot->specification().observation_size());
    std::vector<double> action(robot.action_size());
    Actions actions("random", 0, static_cast<int>(action.size()));
    SensorNoise noise;
    noise.joint_position.assign(action.size(), 0.1);
    noise.joint_velocity = noise.joint_position;
    noise.ranges.assign(10, 0.1);
    robot.reset(0);
    const Counting counting;
    for (int i = 0; i < 500; ++i) {
      robot.robot->observe(noise, observation.data());
      actions.draw(observation, action);
      robot.step(action, {i % 10 == 0 ? 5.0 : 0.0, 0});
    }
    EXPECT_EQ(allocations, 0) << id;
  }
}

}  // namespace
}  // namespace walker::mujoco
