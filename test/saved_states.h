// Saves and loads environment states and compares the subsequent episodes.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <string>
#include <vector>

#include "bits.h"
#include "stepper.h"

namespace walker {

using State = std::vector<std::byte>;

inline State save(const Stepper& walker) {
  State state;
  walker.environment->save_state(state);
  return state;
}

inline Progress load(Stepper& walker, const State& state) {
  return walker.environment->load_state(state.data(), state.size(), walker.result);
}

inline std::vector<double> look_at(Environment& environment) {
  Sensors sensors;
  Scene scene;
  environment.sense(sensors);
  environment.scene(scene);
  std::vector<double> numbers;
  const auto add = [&numbers](const auto& values) {
    numbers.insert(numbers.end(), values.begin(), values.end());
  };
  add(sensors.joint_position);
  add(sensors.joint_velocity);
  add(sensors.joint_effort);
  for (const Pose& pose : sensors.link_poses) {
    add(pose.position);
    add(pose.orientation);
  }
  add(sensors.linear_velocity);
  add(sensors.angular_velocity);
  add(sensors.linear_acceleration);
  add(sensors.gravity);
  add(sensors.ranges);
  add(sensors.contacts);
  for (const auto* polygons : {&scene.ground, &scene.obstacles, &scene.clouds}) {
    for (const ScenePolygon& polygon : *polygons) {
      for (const auto& point : polygon.points) add(point);
    }
  }
  return numbers;
}

/// Compares the last results and the complete states to the bit.
inline void expect_alike(const Stepper& actual, const Stepper& expected) {
  ASSERT_EQ(to_bits(actual.row()), to_bits(expected.row()));
  ASSERT_STREQ(actual.result.end_reason, expected.result.end_reason);
  ASSERT_STREQ(actual.result.error, expected.result.error);
  ASSERT_EQ(actual.environment->generator_state(), expected.environment->generator_state());
  ASSERT_EQ(to_bits(look_at(*actual.environment)), to_bits(look_at(*expected.environment)));
  ASSERT_EQ(save(actual), save(expected));
}

/// Plays the rest of the episode and `num_resets` further episodes and compares each step.
template <typename Actions>
void expect_alike_from_here(Stepper& actual, Stepper& expected, Actions&& actions,
                            int num_resets = 2, int most_steps = 400) {
  std::vector<double> action;
  for (int reset = 0;; ++reset) {
    ASSERT_NO_FATAL_FAILURE(expect_alike(actual, expected)) << "after " << reset << " resets";
    for (int step = 0; step < most_steps && !expected.has_ended(); ++step) {
      actions.draw(expected.observation, action);
      expected.step(action);
      actual.step(action);
      ASSERT_EQ(to_bits(actual.row()), to_bits(expected.row()))
          << "after " << reset << " resets and " << step + 1 << " steps";
    }
    ASSERT_NO_FATAL_FAILURE(expect_alike(actual, expected)) << "after " << reset << " resets";
    if (reset == num_resets) return;
    expected.reset();
    actual.reset();
  }
}

}  // namespace walker
