// Episodes of worlds through the robot's interface: groups, saved states, noisy sensors.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <utility>

#include "observer.h"
#include "robots/bipedal_walker/random_world.h"

namespace walker::bipedal_walker {
namespace {

std::vector<std::byte> saved(const Robot& robot) {
  std::vector<std::byte> bytes;
  StateWriter writer(bytes);
  robot.save(writer);
  return bytes;
}

void load(Robot& robot, const std::vector<std::byte>& bytes, const WorldValues& values) {
  StateReader reader(bytes.data(), bytes.size());
  const auto apply = robot.load(reader, values, true);
  reader.finish();
  apply();
}

std::vector<double> observed(const Robot& robot) {
  std::vector<double> observation(kObservationSize);
  robot.observe(observation.data());
  return observation;
}

/// Resets and steps of random worlds and plain ones, in groups of all sizes, against single ones.
TEST(WorldEpisodesTest, GroupsHaveTheBitsOfSingleSteps) {
  Generator random(3);
  for (std::size_t size = 1; size <= kMaxGroupSize; size += size < 17 ? 1 : 9) {
    std::vector<std::unique_ptr<Robot>> single;
    std::vector<std::unique_ptr<Robot>> grouped;
    std::vector<Generator> generators;
    for (std::size_t i = 0; i < size; ++i) {
      const char* const id = i % 3 == 0 ? kHardcore : kPlain;
      const WorldValues values = i % 2 == 0 ? WorldValues{} : random_values(random, i % 3 == 0);
      single.push_back(make_robot(id));
      single.back()->set_world(values);
      grouped.push_back(make_robot(id));
      grouped.back()->set_world(values);
      generators.emplace_back(100 * size + i);
    }
    for (int time = 0; time < 40; ++time) {
      std::vector<std::vector<double>> actions;
      std::vector<RobotStep> steps(size);
      std::vector<RobotStep*> pointers;
      std::vector<Generator> for_group = generators;
      for (std::size_t i = 0; i < size; ++i) {
        actions.push_back(draw_action(random));
        RobotStep& step = steps[i];
        step.robot = grouped[i].get();
        step.action = actions[i].data();
        if (random.integers(0, 3) == 0) step.push = {random.uniform(-3, 3), random.uniform(-3, 3)};
        if (random.integers(0, 5) == 0) {
          const auto link = static_cast<std::uint32_t>(random.integers(0, 5));
          step.wrenches = {{link, random.uniform(-90, 90), random.uniform(-90, 90), 5}};
        }
        if (time == 0 || random.integers(0, 30) == 0) step.generator = &for_group[i];
        pointers.push_back(&step);
      }
      std::vector<RobotStep> expected = steps;
      grouped[0]->step_group(pointers.data(), size);
      for (std::size_t i = 0; i < size; ++i) {
        RobotStep& step = expected[i];
        if (step.generator != nullptr) {
          single[i]->reset(generators[i], nullptr);
        } else {
          single[i]->step(step);
        }
        ASSERT_FALSE(steps[i].failure);
        ASSERT_EQ(saved(*grouped[i]), saved(*single[i]))
            << "robot " << i << " of " << size << " at " << time;
        ASSERT_EQ(observed(*grouped[i]), observed(*single[i]));
        if (step.generator == nullptr) {
          ASSERT_EQ(steps[i].reward, step.reward);
          ASSERT_EQ(steps[i].terminated, step.terminated);
        }
      }
      generators = for_group;
    }
  }
}

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

/// Also one with the same terrain, but another gravity, and Gymnasium's.
TEST(WorldEpisodesTest, StatesOfAnotherWorldReplaceIt) {
  Generator random(8);
  for (const WorldValues& values :
       {WorldValues{{"mass_scale", 2}}, WorldValues{{"ground_roughness", 3}},
        WorldValues{{"friction_scale", 0.5}}, WorldValues{{"lidar_range", 2}},
        WorldValues{{"joint_damping", 0.1}},
        WorldValues{{"gravity", -3}, {"hip_speed", 3}, {"knee_speed", 4}, {"initial_push", 1}},
        WorldValues{{"motor_strength", 0.5}, {"stump_height", 1}, {"pit_gap", 1}}}) {
    for (const auto& [world, before] :
         {std::pair(values, WorldValues{}), std::pair(WorldValues{}, values)}) {
      Player original(world, 1);
      Player other(before, 1);
      for (int k = 0; k < 25; ++k) original.step(draw_action(random));
      load(*other.robot, saved(*original.robot), world);
      other.generator = original.generator;
      other.observe();
      for (int k = 0; k < 40; ++k) {
        ASSERT_EQ(saved(*other.robot), saved(*original.robot)) << to_string(as_numbers(values));
        ASSERT_EQ(other.observation, original.observation);
        ASSERT_EQ(other.sensors.ranges, original.sensors.ranges);
        ASSERT_EQ(other.sensors.maximum_range, original.sensors.maximum_range);
        const std::vector<double> action = draw_action(random);
        for (Player* player : {&original, &other}) {
          if (k == 20) player->reset();
          player->step(action);
        }
      }
    }
  }
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

TEST(WorldEpisodesTest, NoiseChangesItsValuesOnly) {
  Player player({}, 1);
  const auto changed_by = [&](const SensorNoise& noise) {
    std::vector<double> observation(kObservationSize);
    player.robot->observe(noise, observation.data());
    std::vector<std::size_t> changed;
    for (std::size_t i = 0; i < observation.size(); ++i) {
      if (observation[i] != player.observation[i]) changed.push_back(i);
    }
    return changed;
  };
  using Indices = std::vector<std::size_t>;
  const std::vector<std::pair<std::function<void(SensorNoise&)>, Indices>> cases{
      {[](SensorNoise& n) {
         n.joint_position = {0, 0.1, 0, 0};
       },
       {kFirstLeg + 2}},
      {[](SensorNoise& n) {
         n.joint_velocity = {0, 0, 0.1, 0};
       },
       {kSecondLeg + 1}},
      {[](SensorNoise& n) {
         n.linear_velocity = {0.1, 0};
       },
       {kHorizontalSpeed}},
      {[](SensorNoise& n) {
         n.linear_velocity = {0, 0.1};
       },
       {kVerticalSpeed}},
      {[](SensorNoise& n) { n.angular_velocity = 0.1; },
       {kHullAngularVelocity, kHorizontalSpeed, kVerticalSpeed}}};
  for (const auto& [set, indices] : cases) {
    SensorNoise noise;
    set(noise);
    EXPECT_EQ(changed_by(noise), indices);
  }
  SensorNoise noise;
  noise.ranges.assign(kLidarRays, 0.1);
  Indices hits;
  for (std::size_t i = 0; i < kLidarRays; ++i) {
    if (std::isfinite(player.sensors.ranges[i])) hits.push_back(kFirstRay + i);
  }
  EXPECT_EQ(changed_by(noise), hits);
  EXPECT_GT(hits.size(), 3U);
}

}  // namespace
}  // namespace walker::bipedal_walker
