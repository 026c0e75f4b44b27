// Resets, their random numbers, and the end of episodes.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "base/random.h"
#include "robots/mujoco/player.h"
#include "stepper.h"

namespace walker::mujoco {
namespace {

const char* const kIds[] = {"Walker2d-v4", "Walker2d-v5"};

Parameters whole_state() { return {{"exclude_current_positions_from_observation", false}}; }

/// Draws a state: nine positions around the upright stance, then nine velocities.
std::vector<double> draw_state(Generator& generator, double scale) {
  std::vector<double> state(2 * std::size_t{kDegreesOfFreedom});
  for (double& value : state) value = generator.uniform(-scale, scale);
  state[kBaseZ] += 1.25;
  return state;
}

std::vector<std::vector<double>> play(Stepper& walker, const char* kind, std::uint64_t seed) {
  std::vector<std::vector<double>> rows{walker.row()};
  Actions actions(kind, seed);
  std::vector<double> action;
  while (!walker.has_ended()) {
    actions.draw(walker.observation, action);
    walker.step(action);
    rows.push_back(walker.row());
  }
  return rows;
}

/// Converts rows to text, because NaN, which marks absent infos, does not equal itself.
std::string text(const std::vector<std::vector<double>>& rows) {
  std::string result;
  for (const std::vector<double>& row : rows) result += to_string(row) + "\n";
  return result;
}

TEST(Resets, DrawPositionsThenVelocities) {
  for (const char* id : kIds) {
    for (const double scale : {5e-3, 0.3, 0.0}) {
      Parameters parameters = whole_state();
      parameters["reset_noise_scale"] = scale;
      Stepper walker(id, parameters);
      Generator generator(42);
      walker.reset(42);
      EXPECT_EQ(walker.observation, draw_state(generator, scale)) << id << " " << scale;
      EXPECT_EQ(walker.environment->generator_state(), generator.state());
      walker.reset();
      EXPECT_EQ(walker.observation, draw_state(generator, scale)) << id << " " << scale;
      EXPECT_EQ(walker.environment->generator_state(), generator.state());
    }
  }
}

TEST(Resets, ClipVelocitiesInTheObservationOnly) {
  Parameters parameters = whole_state();
  parameters["reset_noise_scale"] = 20.0;
  Stepper walker("Walker2d-v5", parameters);
  Generator generator(1);
  walker.reset(1);
  const std::vector<double> state = draw_state(generator, 20);
  int clipped = 0;
  for (std::size_t i = 0; i < state.size(); ++i) {
    const bool is_velocity = i >= kDegreesOfFreedom;
    const bool is_fast = is_velocity && std::abs(state[i]) > 10;
    clipped += is_fast ? 1 : 0;
    EXPECT_EQ(walker.observation[i], is_fast ? std::copysign(10, state[i]) : state[i]) << i;
  }
  EXPECT_GT(clipped, 0);
  Sensors sensors;
  walker.environment->sense(sensors);
  EXPECT_EQ(sensors.linear_velocity[0], state[kDegreesOfFreedom]);
}

TEST(Resets, HaveNoGeneratorStateBeforeTheFirst) {
  Stepper walker("Walker2d-v5");
  EXPECT_EQ(walker.environment->generator_state(), GeneratorState{});
  walker.reset();
  const std::vector<double> first = walker.observation;
  EXPECT_NE(walker.environment->generator_state(), GeneratorState{});
  Stepper other("Walker2d-v5");
  other.reset();
  EXPECT_NE(other.observation, first) << "seeded from the system";
}

TEST(Resets, DependOnTheSeedAlone) {
  for (const char* id : kIds) {
    Stepper fresh(id);
    fresh.reset(8);
    const std::string expected = text(play(fresh, "smooth", 1));
    Stepper used(id);
    used.reset(3);
    for (int i = 0; i < 7; ++i) used.step({1, -1, 1, -1, 1, -1});
    used.reset(8);
    EXPECT_EQ(text(play(used, "smooth", 1)), expected) << id << " after some steps";
    used.reset(8);
    EXPECT_EQ(text(play(used, "smooth", 1)), expected) << id << " after an end";
    used.reset();
    play(used, "saturated", 2);
    used.reset(8);
    EXPECT_EQ(text(play(used, "smooth", 1)), expected) << id << " after other actions";
    used.reset(9);
    EXPECT_NE(text(play(used, "smooth", 1)), expected) << id << " with another seed";
  }
}

TEST(Episodes, EndWhenUnhealthyWithTheReason) {
  for (const char* id : kIds) {
    Parameters parameters = whole_state();
    parameters["healthy_angle_range"] = std::vector<double>{-9, 9};
    Stepper low(id, parameters);
    low.reset(0);
    play(low, "zero", 0);
    EXPECT_TRUE(low.result.terminated);
    EXPECT_FALSE(low.result.truncated);
    EXPECT_LE(low.observation[kBaseZ], 0.8);
    EXPECT_STREQ(low.result.end_reason, "the torso's height left healthy_z_range");
    EXPECT_STREQ(low.result.error, "");
    parameters = whole_state();
    parameters["healthy_z_range"] = std::vector<double>{-9, 9};
    Stepper tilted(id, parameters);
    tilted.reset(0);
    play(tilted, "saturated", 0);
    EXPECT_TRUE(tilted.result.terminated);
    EXPECT_GE(std::abs(tilted.observation[kBasePitch]), 1);
    EXPECT_STREQ(tilted.result.end_reason, "the torso's angle left healthy_angle_range");
    EXPECT_THROW(tilted.step({0, 0, 0, 0, 0, 0}), ResetNeeded);
  }
}

/// The healthy range is an open interval.
TEST(Episodes, EndOnTheEdgeOfTheRange) {
  Parameters parameters = whole_state();
  Stepper walker("Walker2d-v5", parameters);
  walker.reset(0);
  walker.step({0, 0, 0, 0, 0, 0});
  const double height = walker.observation[kBaseZ];
  for (const auto& range : {std::vector<double>{height, 9}, std::vector<double>{-9, height}}) {
    parameters["healthy_z_range"] = range;
    Stepper edge("Walker2d-v5", parameters);
    edge.reset(0);
    edge.step({0, 0, 0, 0, 0, 0});
    EXPECT_EQ(edge.observation[kBaseZ], height);
    EXPECT_TRUE(edge.result.terminated) << range[0];
  }
}

}  // namespace
}  // namespace walker::mujoco
