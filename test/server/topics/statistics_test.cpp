// Timing of synthetic steps, and statistics of synthetic episodes.
#include "server/topics/statistics.h"

#include <gtest/gtest.h>

namespace walker {
namespace {

using std::chrono::hours;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;
using Time = StepTiming::Clock::time_point;
using Duration = StepTiming::Clock::duration;

constexpr double kMicrosecond = 1e-6;
constexpr double kTolerance = 1e-12;
const Time kStart{hours(1000)};

TEST(StepTiming, ComputesQuantilesOfDeviationsInBothDirections) {
  StepTiming timing;
  Time now = kStart;
  timing.step_begins(now, milliseconds(20));
  // 1 us too long, 2 us too short, 3 us too long, ... 2000 us too short.
  for (int i = 1; i <= 2000; ++i) {
    now += milliseconds(20) + (i % 2 == 1 ? i : -i) * microseconds(1);
    timing.step_begins(now, milliseconds(20));
  }
  const auto jitter = timing.report().jitter;
  ASSERT_TRUE(jitter);
  EXPECT_NEAR(jitter->median, 1000 * kMicrosecond, kTolerance);
  EXPECT_NEAR(jitter->percentile_99, 1980 * kMicrosecond, kTolerance);
  EXPECT_NEAR(jitter->percentile_999, 1998 * kMicrosecond, kTolerance);
  EXPECT_NEAR(jitter->largest, 2000 * kMicrosecond, kTolerance);
}

TEST(StepTiming, NeedsOneInterval) {
  StepTiming timing;
  timing.step_begins(kStart, milliseconds(8));
  EXPECT_FALSE(timing.report().jitter) << "one step has no interval";
  // A report does not separate the steps before and after it.
  timing.step_begins(kStart + microseconds(8007), milliseconds(8));
  const auto jitter = timing.report().jitter;
  ASSERT_TRUE(jitter);
  for (const double value :
       {jitter->median, jitter->percentile_99, jitter->percentile_999, jitter->largest}) {
    EXPECT_NEAR(value, 7 * kMicrosecond, kTolerance);
  }
}

TEST(StepTiming, LeavesOutInterruptedAndUnplannedIntervals) {
  StepTiming timing;
  timing.step_begins(kStart, milliseconds(20));
  timing.interrupt();
  timing.step_begins(kStart + seconds(10), milliseconds(20));
  timing.step_begins(kStart + seconds(11), milliseconds(0));
  timing.step_begins(kStart + seconds(12), milliseconds(0));
  timing.step_begins(kStart + seconds(13), milliseconds(20));
  EXPECT_FALSE(timing.report().jitter);
}

TEST(StepTiming, ComputesQuantilesOfTheLatestIntervals) {
  StepTiming timing;
  Time now = kStart;
  const auto add = [&](std::size_t intervals, Duration deviation) {
    for (std::size_t i = 0; i < intervals; ++i) {
      now += milliseconds(1) + deviation;
      timing.step_begins(now, milliseconds(1));
    }
  };
  timing.step_begins(now, milliseconds(1));
  add(StepTiming::kCapacity, microseconds(500));
  add(StepTiming::kCapacity, microseconds(3));
  const auto jitter = timing.report().jitter;
  ASSERT_TRUE(jitter);
  EXPECT_NEAR(jitter->percentile_99, 3 * kMicrosecond, kTolerance);
  EXPECT_NEAR(jitter->largest, 500 * kMicrosecond, kTolerance) << "the largest is of all";
}

TEST(StepTiming, ComputesMeanAndLargestStepTime) {
  StepTiming timing;
  EXPECT_FALSE(timing.report().duration);
  for (const Duration duration :
       {Duration(microseconds(100)), Duration(microseconds(500)), Duration(microseconds(300))}) {
    timing.step_took(duration);
  }
  const auto duration = timing.report().duration;
  ASSERT_TRUE(duration);
  EXPECT_NEAR(duration->mean, 300 * kMicrosecond, kTolerance);
  EXPECT_NEAR(duration->largest, 500 * kMicrosecond, kTolerance);
}

TEST(StepTiming, RestartsWithAReport) {
  StepTiming timing;
  timing.step_begins(kStart, milliseconds(20));
  timing.step_begins(kStart + milliseconds(90), milliseconds(20));
  timing.step_took(milliseconds(70));
  timing.report();
  EXPECT_FALSE(timing.report().jitter);
  EXPECT_FALSE(timing.report().duration);
  timing.step_begins(kStart + milliseconds(110), milliseconds(20));
  timing.step_took(milliseconds(1));
  const StepTiming::Report report = timing.report();
  EXPECT_EQ(report.jitter->largest, 0);
  EXPECT_NEAR(report.duration->largest, 1e-3, kTolerance);
}

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
