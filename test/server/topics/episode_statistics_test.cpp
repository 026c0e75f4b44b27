// Statistics of synthetic episodes.
#include "server/topics/episode_statistics.h"

#include <gtest/gtest.h>

#include <cmath>

namespace walker {
namespace {

constexpr double kTolerance = 1e-12;

EpisodeState terminated(double episode_return, std::uint32_t length) {
  EpisodeState state;
  state.episode_return = episode_return;
  state.step = length;
  state.terminated = true;
  return state;
}

EpisodeState truncated(double episode_return, std::uint32_t length) {
  EpisodeState state = terminated(episode_return, length);
  state.terminated = false;
  state.truncated = true;
  return state;
}

TEST(EpisodeStatistics, AreZeroWithoutEpisodes) {
  const auto summary = EpisodeStatistics().summary();
  EXPECT_EQ(summary.episodes, 0U);
  EXPECT_EQ(summary.return_mean, 0);
  EXPECT_EQ(summary.return_deviation, 0);
  EXPECT_EQ(summary.length_mean, 0);
}

TEST(EpisodeStatistics, EqualTheOnlyEpisode) {
  EpisodeStatistics statistics;
  statistics.add(terminated(-93.5, 81));
  const auto summary = statistics.summary();
  EXPECT_EQ(summary.episodes, 1U);
  EXPECT_EQ(summary.return_mean, -93.5);
  EXPECT_EQ(summary.return_deviation, 0);
  EXPECT_EQ(summary.return_min, -93.5);
  EXPECT_EQ(summary.return_max, -93.5);
  EXPECT_EQ(summary.length_mean, 81);
}

TEST(EpisodeStatistics, ComputeMeanAndDeviation) {
  EpisodeStatistics statistics;
  // numpy.std([2, 4, 4, 4, 5, 5, 7, 9]) is 2.
  std::uint32_t length = 10;
  for (const double episode_return : {2., 4., 4., 4., 5., 5., 7., 9.}) {
    statistics.add(truncated(episode_return, length += 10));
  }
  const auto summary = statistics.summary();
  EXPECT_EQ(summary.episodes, 8U);
  EXPECT_NEAR(summary.return_mean, 5, kTolerance);
  EXPECT_NEAR(summary.return_deviation, 2, kTolerance);
  EXPECT_EQ(summary.return_min, 2);
  EXPECT_EQ(summary.return_max, 9);
  EXPECT_NEAR(summary.length_mean, 55, kTolerance);
}

TEST(EpisodeStatistics, CoverTheLast100Episodes) {
  EpisodeStatistics statistics;
  for (int i = 0; i < 37; ++i) statistics.add(terminated(-1e6, 1));
  for (int i = 0; i < 50; ++i) statistics.add(terminated(10, 100));
  for (int i = 0; i < 50; ++i) statistics.add(truncated(20, 200));
  const auto summary = statistics.summary();
  EXPECT_EQ(summary.episodes, 100U);
  EXPECT_NEAR(summary.return_mean, 15, kTolerance);
  EXPECT_NEAR(summary.return_deviation, 5, kTolerance);
  EXPECT_EQ(summary.return_min, 10);
  EXPECT_EQ(summary.return_max, 20);
  EXPECT_NEAR(summary.length_mean, 150, kTolerance);
  EXPECT_EQ(summary.terminated, 50U);
  EXPECT_EQ(summary.truncated, 50U);
}

TEST(EpisodeStatistics, CountEachEpisodeOnceByItsEnd) {
  EpisodeStatistics statistics;
  EpisodeState failed = terminated(1, 2);
  failed.error = "physics: NaN";
  statistics.add(failed);
  EpisodeState both = terminated(1, 1600);
  both.truncated = true;
  statistics.add(both);
  for (int i = 0; i < 3; ++i) statistics.add(terminated(1, 2));
  for (int i = 0; i < 5; ++i) statistics.add(truncated(1, 2));
  const auto summary = statistics.summary();
  EXPECT_EQ(summary.failed, 1U);
  EXPECT_EQ(summary.terminated, 4U);
  EXPECT_EQ(summary.truncated, 5U);
}

TEST(EpisodeStatistics, KeepASmallDeviationOfLargeReturns) {
  EpisodeStatistics statistics;
  for (int i = 0; i < 100; ++i) statistics.add(terminated(1e9 + (i % 2 == 0 ? -1 : 1), 1));
  EXPECT_NEAR(statistics.summary().return_deviation, 1, 1e-6);
}

}  // namespace
}  // namespace walker
