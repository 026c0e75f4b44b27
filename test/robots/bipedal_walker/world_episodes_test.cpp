// Worlds and noisy sensors through the robot's interface.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "observer.h"
#include "robots/bipedal_walker/random_world.h"

namespace walker::bipedal_walker {
namespace {

TEST(WorldEpisodesTest, ANewLidarRangeHoldsFromTheNextReset) {
  Player player({}, 1);
  player.robot->set_world({{"lidar_range", 2}});
  player.step({0, 0, 0, 0});
  EXPECT_EQ(player.sensors.maximum_range, kLidarRange);
  player.reset();
  EXPECT_EQ(player.sensors.maximum_range, 2);
  player.robot->set_world({});
  player.reset();
  EXPECT_EQ(player.sensors.maximum_range, kLidarRange);
}

SensorNoise draw_noise(Generator& random) {
  SensorNoise noise;
  for (std::size_t i = 0; i < kJointCount; ++i) {
    noise.joint_position.push_back(random.uniform(-0.3, 0.3));
    noise.joint_velocity.push_back(random.uniform(-2, 2));
  }
  noise.pitch = random.uniform(-0.4, 0.4);
  noise.angular_velocity = random.uniform(-2, 2);
  noise.linear_velocity = {random.uniform(-1, 1), random.uniform(-1, 1)};
  for (int i = 0; i < kLidarRays; ++i) noise.ranges.push_back(random.uniform(-4, 4));
  return noise;
}

/// Bound of ObservationBuilder.
constexpr double kBound = 1.2e-7;

TEST(WorldEpisodesTest, NoisyObservationIsThatOfNoisySensors) {
  Generator random(6);
  int clamped = 0;
  for (int i = 0; i < 40; ++i) {
    const WorldValues values = i % 2 == 0 ? WorldValues{} : random_values(random);
    Player player(values, i);
    const auto builder = walker::make_observation_builder(kPlain);
    builder->reset();
    std::vector<double> noisy(kObservationSize);
    std::vector<double> built(kObservationSize);
    for (int k = 0; k < 60 && !player.result.terminated; ++k) {
      const SensorNoise noise = draw_noise(random);
      player.robot->observe(noise, noisy.data());
      add(noise, player.sensors);
      Measurements measurements = measurements_of(player.sensors);
      measurements.maximum_range = player.sensors.maximum_range;
      builder->build(measurements, built.data());
      for (std::size_t n = 0; n < built.size(); ++n) {
        // Values beyond 1 have larger roundings.
        const double bound = kBound * std::max(1.0, std::abs(noisy[n]));
        ASSERT_NEAR(noisy[n], built[n], bound)
            << "value " << n << ", world " << i << ", step " << k;
      }
      clamped += static_cast<int>(
          std::count(player.sensors.ranges.begin(), player.sensors.ranges.end(), 0.0));
      player.step(draw_action(random));
    }
  }
  EXPECT_GT(clamped, 10);
}

TEST(WorldEpisodesTest, WithoutNoiseNoBitChanges) {
  Generator random(6);
  Player player({}, 1);
  SensorNoise none;
  none.joint_position.resize(kJointCount);
  none.joint_velocity.resize(kJointCount);
  none.ranges.resize(kLidarRays);
  std::vector<double> observation(kObservationSize);
  for (int k = 0; k < 100; ++k) {
    for (const SensorNoise& noise : {none, SensorNoise{}}) {
      player.robot->observe(noise, observation.data());
      ASSERT_EQ(observation, player.observation);
    }
    player.step(draw_action(random));
  }
}

}  // namespace
}  // namespace walker::bipedal_walker
