// Jitter and step times of made-up steps.
#include "server/step_timing.h"

#include <gtest/gtest.h>

namespace walker {
namespace {

using namespace std::chrono_literals;
using Time = StepTiming::Clock::time_point;
using Duration = StepTiming::Clock::duration;

constexpr double kMicrosecond = 1e-6;
constexpr double kTolerance = 1e-12;
const Time kStart{1000h};

TEST(StepTiming, JitterIsTheDeviationFromThePeriodInEitherDirection) {
  StepTiming timing;
  Time now = kStart;
  timing.step_begins(now, 20ms);
  // 1 us too long, 2 us too short, 3 us too long, ... 100 us too short.
  for (int i = 1; i <= 100; ++i) {
    now += 20ms + (i % 2 == 1 ? i : -i) * 1us;
    timing.step_begins(now, 20ms);
  }
  const auto jitter = timing.report().jitter;
  ASSERT_TRUE(jitter);
  EXPECT_NEAR(jitter->median, 50 * kMicrosecond, kTolerance);
  EXPECT_NEAR(jitter->percentile_99, 99 * kMicrosecond, kTolerance);
  EXPECT_NEAR(jitter->largest, 100 * kMicrosecond, kTolerance);
}

TEST(StepTiming, OneIntervalIsEnough) {
  StepTiming timing;
  timing.step_begins(kStart, 8ms);
  EXPECT_FALSE(timing.report().jitter) << "one step has no interval";
  timing.step_begins(kStart + 8007us, 8ms);  // the report does not part the two
  const auto jitter = timing.report().jitter;
  ASSERT_TRUE(jitter);
  EXPECT_NEAR(jitter->median, 7 * kMicrosecond, kTolerance);
  EXPECT_NEAR(jitter->percentile_99, 7 * kMicrosecond, kTolerance);
  EXPECT_NEAR(jitter->largest, 7 * kMicrosecond, kTolerance);
}

TEST(StepTiming, AnInterruptionIsNoInterval) {
  StepTiming timing;
  timing.step_begins(kStart, 20ms);
  timing.interrupt();
  timing.step_begins(kStart + 10s, 20ms);
  EXPECT_FALSE(timing.report().jitter);
}

TEST(StepTiming, WithoutAPlanThereIsNoJitter) {
  StepTiming timing;
  timing.step_begins(kStart, 20ms);
  timing.step_begins(kStart + 1ms, 0ms);
  timing.step_begins(kStart + 2ms, 0ms);
  timing.step_begins(kStart + 3ms, 20ms);
  EXPECT_FALSE(timing.report().jitter);
}

TEST(StepTiming, BeyondItsCapacityQuantilesAreOfTheLatestIntervals) {
  StepTiming timing;
  Time now = kStart;
  const auto add = [&](std::size_t intervals, Duration deviation) {
    for (std::size_t i = 0; i < intervals; ++i) {
      now += 1ms + deviation;
      timing.step_begins(now, 1ms);
    }
  };
  timing.step_begins(now, 1ms);
  add(StepTiming::kCapacity, 500us);
  add(StepTiming::kCapacity, 3us);
  const auto jitter = timing.report().jitter;
  ASSERT_TRUE(jitter);
  EXPECT_NEAR(jitter->percentile_99, 3 * kMicrosecond, kTolerance);
  EXPECT_NEAR(jitter->largest, 500 * kMicrosecond, kTolerance) << "the largest is of all";
}

TEST(StepTiming, MeanAndLargestStepTime) {
  StepTiming timing;
  EXPECT_FALSE(timing.report().duration);
  for (const Duration duration : {Duration(100us), Duration(500us), Duration(300us)}) {
    timing.step_took(duration);
  }
  const auto duration = timing.report().duration;
  ASSERT_TRUE(duration);
  EXPECT_NEAR(duration->mean, 300 * kMicrosecond, kTolerance);
  EXPECT_NEAR(duration->largest, 500 * kMicrosecond, kTolerance);
}

TEST(StepTiming, AReportBeginsAnew) {
  StepTiming timing;
  timing.step_begins(kStart, 20ms);
  timing.step_begins(kStart + 90ms, 20ms);
  timing.step_took(70ms);
  timing.report();
  EXPECT_FALSE(timing.report().jitter);
  EXPECT_FALSE(timing.report().duration);
  timing.step_begins(kStart + 110ms, 20ms);
  timing.step_took(1ms);
  const StepTiming::Report report = timing.report();
  EXPECT_EQ(report.jitter->largest, 0);
  EXPECT_NEAR(report.duration->largest, 1e-3, kTolerance);
}

}  // namespace
}  // namespace walker
