// Compares the states of two episodes.
#pragma once

#include <gtest/gtest.h>

#include "bits.h"
#include "episode/episode.h"

namespace walker {

/// Compares all members to the bit, except the environment's index and the episode's number.
inline void expect_same_state(const EpisodeState& actual, const EpisodeState& expected) {
  EXPECT_EQ(actual.step, expected.step);
  EXPECT_EQ(to_bits(actual.action), to_bits(expected.action));
  EXPECT_EQ(to_bits(actual.observation), to_bits(expected.observation));
  EXPECT_EQ(to_bits(actual.info), to_bits(expected.info));
  EXPECT_EQ(to_bits(actual.reward), to_bits(expected.reward));
  EXPECT_EQ(to_bits(actual.episode_return), to_bits(expected.episode_return));
  EXPECT_EQ(actual.terminated, expected.terminated);
  EXPECT_EQ(actual.truncated, expected.truncated);
  EXPECT_EQ(actual.end_reason, expected.end_reason);
  EXPECT_EQ(actual.error, expected.error);
  EXPECT_EQ(actual.seed, expected.seed);
  EXPECT_EQ(actual.generator_state, expected.generator_state);
}

}  // namespace walker
