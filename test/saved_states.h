// Saves and loads environment states and compares the subsequent episodes.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "bits.h"
#include "episode/saved_state.h"
#include "error_message.h"
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

constexpr const char* kNothing = "nothing thrown";

/// Returns the message of the error with which the state is rejected, or kNothing.
inline std::string refusal(Stepper& walker, const State& state) {
  return message_of<std::invalid_argument>([&] { load(walker, state); });
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

/// Plays up to `most_steps` random steps between saves. Each state is loaded by a fresh environment
/// and by one amid its own episode; both must be like the environment that was saved.
/// @param actions_of returns the source of actions with this seed
template <typename Saver, typename Loader, typename ActionsOf>
void expect_same_future(const Saver& make_saver, const Loader& make_loader,
                        const ActionsOf& actions_of, int times, unsigned most_steps) {
  Stepper original = make_saver();
  Stepper other = make_loader();
  original.reset(21);
  other.reset(21);  // the same terrain, perhaps in another world
  auto actions = actions_of(1);
  std::vector<double> action;
  std::mt19937 random(3);
  for (int time = 0; time < times; ++time) {
    SCOPED_TRACE("time " + std::to_string(time));
    for (auto i = random() % most_steps; i > 0; --i) {
      if (original.has_ended()) {
        original.reset();
        continue;
      }
      actions.draw(original.observation, action);
      original.step(action);
    }
    const State state = save(original);
    Stepper fresh = make_loader();
    load(fresh, state);
    load(other, state);
    ASSERT_NO_FATAL_FAILURE(expect_alike(fresh, original));
    ASSERT_NO_FATAL_FAILURE(expect_alike_from_here(other, fresh, actions_of(time)));
    load(other, state);
    ASSERT_NO_FATAL_FAILURE(expect_alike(other, original));
    Stepper twin = make_saver();
    load(twin, state);
    ASSERT_NO_FATAL_FAILURE(expect_alike_from_here(twin, other, actions_of(time)));
    if (time % 2 == 1) other.reset(time);  // terrain differs from that of the next state
  }
}

/// Overwrites every `stride`-th place of the state with numbers that are not finite or very large,
/// under a valid checksum: the state is rejected, or observations and rewards are finite.
inline void expect_finite_numbers(Stepper& walker, std::size_t stride) {
  constexpr std::size_t kHeaderBytes = 28;
  const State state = save(walker);
  const std::vector<double> action(walker.environment->specification().action_size());
  int num_rejected = 0;
  const auto try_number = [&](std::size_t at, const auto number) {
    if (at + sizeof number > state.size()) return;
    State forged = state;
    std::memcpy(&forged[at], &number, sizeof number);
    StateOrigin::seal(forged, 0);
    if (refusal(walker, forged) != kNothing) {
      ++num_rejected;
      return;
    }
    for (int step = 0; step < 3; ++step) {
      for (const double value : walker.observation) ASSERT_TRUE(std::isfinite(value)) << at;
      ASSERT_TRUE(std::isfinite(walker.result.reward)) << at;
      if (walker.has_ended()) return;
      walker.step(action);
    }
  };
  for (std::size_t at = kHeaderBytes; at < state.size(); at += stride) {
    ASSERT_NO_FATAL_FAILURE(try_number(at, std::numeric_limits<double>::quiet_NaN()));
    ASSERT_NO_FATAL_FAILURE(try_number(at, -std::numeric_limits<double>::infinity()));
    ASSERT_NO_FATAL_FAILURE(try_number(at, std::numeric_limits<double>::max()));
    ASSERT_NO_FATAL_FAILURE(try_number(at, std::numeric_limits<float>::infinity()));
    ASSERT_NO_FATAL_FAILURE(try_number(at, std::numeric_limits<float>::max()));
  }
  EXPECT_GT(num_rejected, 0);
}

}  // namespace walker
