// Comparison of what is known of two episodes.
#pragma once

#include <gtest/gtest.h>

#include "bits.h"
#include "server/shown_environment.h"

namespace walker {

/// To the bit, but for which environment it is and how many episodes came before.
inline void expect_same_state(const EpisodeState& one, const EpisodeState& other) {
  EXPECT_EQ(one.step, other.step);
  EXPECT_EQ(to_bits(one.action), to_bits(other.action));
  EXPECT_EQ(to_bits(one.observation), to_bits(other.observation));
  EXPECT_EQ(to_bits(one.info), to_bits(other.info));
  EXPECT_EQ(to_bits(one.reward), to_bits(other.reward));
  EXPECT_EQ(to_bits(one.episode_return), to_bits(other.episode_return));
  EXPECT_EQ(one.terminated, other.terminated);
  EXPECT_EQ(one.truncated, other.truncated);
  EXPECT_EQ(one.end_reason, other.end_reason);
  EXPECT_EQ(one.error, other.error);
  EXPECT_EQ(one.seed, other.seed);
  EXPECT_EQ(one.generator_state, other.generator_state);
}

}  // namespace walker
