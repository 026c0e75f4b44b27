// The step schedule on a simulated clock.
#include "base/pacer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace walker {
namespace {

using std::chrono::hours;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;
using Time = Pacer::Clock::time_point;
using Duration = Pacer::Clock::duration;

constexpr double kDt = 0.02;
const Time kStart{hours(1000)};

class Loop {
 public:
  explicit Loop(double real_time_factor) : pacer(kDt, real_time_factor) { pacer.restart(now); }

  /// Waits for the deadline plus `lateness`, then takes a step of duration `step`.
  /// @return when the step began
  Time run_step(Duration lateness = Duration::zero(), Duration step = Duration::zero()) {
    now += std::max(pacer.remaining(now), Duration::zero()) + lateness;
    const Time begun = now;
    missed += pacer.step_begins(now);
    now += step;
    return begun;
  }

  int count_steps(Duration wall, Duration step) {
    const Time end = now + wall;
    int steps = 0;
    while (std::max(now, now + pacer.remaining(now)) < end) {
      run_step(Duration::zero(), step);
      ++steps;
    }
    now = end;
    return steps;
  }

  Time now = kStart;
  Pacer pacer;
  std::uint64_t missed = 0;
};

TEST(Pacer, DoesNotDrift) {
  constexpr int kSteps = 1'000'000;
  std::mt19937_64 draws(1);
  // Each step is late by up to one period, exclusive.
  std::uniform_int_distribution<std::int64_t> late(
      0, std::chrono::nanoseconds(milliseconds(20)).count() - 1);
  Loop loop(1);
  for (std::int64_t i = 1; i <= kSteps; ++i) {
    const Duration lateness(late(draws));
    const Time begun = loop.run_step(lateness);
    ASSERT_EQ(begun, kStart + i * milliseconds(20) + lateness);
  }
  EXPECT_EQ(loop.missed, 0U);
}

TEST(Pacer, TheFactorDividesThePeriod) {
  for (const auto& [factor, period] : {std::pair<double, Duration>{0.25, milliseconds(80)},
                                       {1, milliseconds(20)},
                                       {3, nanoseconds(6'666'667)},
                                       {1000, microseconds(20)}}) {
    EXPECT_EQ(Pacer(kDt, factor).period(), period) << factor;
    EXPECT_EQ(Pacer(kDt, factor).real_time_factor(), factor);
  }
}

TEST(Pacer, SmallFactorsDoNotOverflow) {
  for (const double factor : {1e-12, 1e-300, 5e-324}) {
    Pacer pacer(kDt, factor);
    pacer.restart(kStart);
    EXPECT_GT(pacer.remaining(kStart), hours(1000)) << factor;
  }
  Pacer pacer(1e-12, 1000);
  EXPECT_GT(pacer.period(), Duration::zero()) << "zero means as fast as it goes";
}

TEST(Pacer, DoesNotCatchUpAfterAStall) {
  Loop loop(1);
  loop.run_step(milliseconds(0), seconds(1));  // due at 20 ms; the step of 40 ms begins at 1020 ms
  EXPECT_EQ(loop.run_step(), kStart + milliseconds(1020));
  EXPECT_EQ(loop.missed, 49U) << "60, 80, ... 1020 ms";
  for (int i = 1; i <= 10; ++i)
    EXPECT_EQ(loop.run_step(), kStart + milliseconds(1020) + i * milliseconds(20));
  EXPECT_EQ(loop.missed, 49U);
}

TEST(Pacer, ALateStepKeepsTheSchedule) {
  Loop loop(1);
  EXPECT_EQ(loop.run_step(milliseconds(20) - nanoseconds(1)),
            kStart + milliseconds(40) - nanoseconds(1));
  EXPECT_EQ(loop.run_step(), kStart + milliseconds(40));
  EXPECT_EQ(loop.missed, 0U);
  EXPECT_EQ(loop.run_step(milliseconds(20)), kStart + milliseconds(80));
  EXPECT_EQ(loop.missed, 1U);
  EXPECT_EQ(loop.run_step(), kStart + milliseconds(100));
}

TEST(Pacer, BoundsTheDistanceOfSteps) {
  std::mt19937_64 draws(2);
  std::exponential_distribution<double> late(1 / 0.03);  // often more than a period
  Loop loop(1);
  std::vector<Time> begun;
  for (int i = 0; i < 10'000; ++i) {
    const std::chrono::duration<double> lateness(late(draws));
    begun.push_back(loop.run_step(std::chrono::duration_cast<Duration>(lateness)));
  }
  EXPECT_GT(loop.missed, 1000U);
  for (std::size_t i = 0; i < begun.size(); ++i) {
    for (std::size_t j = i + 1; j < std::min(i + 20, begun.size()); ++j) {
      ASSERT_GT(begun[j] - begun[i], static_cast<std::int64_t>(j - i - 1) * milliseconds(20))
          << i << ' ' << j;
    }
  }
}

TEST(Pacer, StepsBackToBackIfTooSlow) {
  // Steps of 1.05, 1.5, 2 and 7.3 periods are back to back, except for one wait of less than a
  // period after each slip.
  for (const Duration step : {Duration(milliseconds(21)), Duration(milliseconds(30)),
                              Duration(milliseconds(40)), Duration(milliseconds(146))}) {
    Loop loop(1);
    constexpr auto kWall = seconds(1000);
    const auto possible = static_cast<double>(kWall / step);
    const int steps = loop.count_steps(kWall, step);
    EXPECT_GT(steps, 0.99 * possible) << step.count();
    // Each deadline is met, missed or moved; a slip moves less than one.
    const auto planned = static_cast<std::int64_t>(kWall / milliseconds(20));
    const auto missed = static_cast<std::int64_t>(loop.missed);
    EXPECT_GT(missed, 0) << step.count();
    EXPECT_LE(missed, planned - steps) << step.count();
    EXPECT_GE(missed, planned - steps - steps) << step.count();
  }
}

TEST(Pacer, ZeroMeansNoPacing) {
  Loop loop(0);
  for (int i = 0; i < 100; ++i) {
    ASSERT_LE(loop.pacer.remaining(loop.now), Duration::zero());
    loop.run_step(milliseconds(0), milliseconds(3));
  }
  EXPECT_EQ(loop.now, kStart + milliseconds(300));
  EXPECT_EQ(loop.missed, 0U);
  EXPECT_EQ(loop.pacer.period(), Duration::zero());
}

TEST(Pacer, ANewFactorCountsFromTheLastStep) {
  Loop loop(1);
  loop.run_step(milliseconds(0), milliseconds(5));  // begins at 20 ms, ends at 25 ms
  loop.pacer.set_real_time_factor(2, loop.now);
  EXPECT_EQ(loop.run_step(), kStart + milliseconds(30));
  EXPECT_EQ(loop.run_step(milliseconds(0), milliseconds(5)), kStart + milliseconds(40));
  loop.pacer.set_real_time_factor(0.5, loop.now);
  EXPECT_EQ(loop.run_step(milliseconds(0), milliseconds(5)), kStart + milliseconds(80));
  EXPECT_EQ(loop.run_step(milliseconds(0), milliseconds(5)), kStart + milliseconds(120));
  loop.pacer.set_real_time_factor(0, loop.now);
  EXPECT_EQ(loop.run_step(milliseconds(0), milliseconds(5)), kStart + milliseconds(125));
  EXPECT_EQ(loop.run_step(milliseconds(0), milliseconds(5)), kStart + milliseconds(130));
  loop.pacer.set_real_time_factor(1, loop.now);
  EXPECT_EQ(loop.run_step(milliseconds(0), milliseconds(5)), kStart + milliseconds(150));
  EXPECT_EQ(loop.missed, 0U);
}

TEST(Pacer, ANewFactorMissesNoDeadline) {
  Loop loop(0.01);  // a step every two seconds
  loop.run_step();
  loop.now += seconds(1);
  loop.pacer.set_real_time_factor(1, loop.now);
  EXPECT_EQ(loop.run_step(), kStart + seconds(3));
  EXPECT_EQ(loop.run_step(), kStart + seconds(3) + milliseconds(20));
  EXPECT_EQ(loop.missed, 0U);
}

TEST(Pacer, StepsWhileTheFactorChangesOften) {
  Loop loop(1);
  int steps = 0;
  for (int i = 0; i < 1000; ++i, loop.now += milliseconds(1)) {
    loop.pacer.set_real_time_factor(i % 2 == 0 ? 1 : 2, loop.now);
    if (loop.pacer.remaining(loop.now) > nanoseconds(0)) continue;
    loop.pacer.step_begins(loop.now);
    ++steps;
  }
  EXPECT_GE(steps, 49);
  EXPECT_LE(steps, 100);
}

TEST(Pacer, ARestartIgnoresThePause) {
  Loop loop(1);
  loop.run_step();
  loop.now += seconds(10);
  loop.pacer.restart(loop.now);
  EXPECT_EQ(loop.run_step(), kStart + seconds(10) + milliseconds(40));
  EXPECT_EQ(loop.missed, 0U);
}

}  // namespace
}  // namespace walker
