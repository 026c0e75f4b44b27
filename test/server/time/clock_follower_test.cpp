// ClockFollower on synthetic times.
#include "server/time/clock_follower.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace walker {
namespace {

constexpr std::uint64_t kMillisecond = 1'000'000;
constexpr std::uint64_t kSecond = 1000 * kMillisecond;
constexpr std::uint64_t kDt = 20 * kMillisecond;

/// A simulation that takes the follower's advice.
class Simulated {
 public:
  /// Makes the steps that are due and returns their number.
  int look(std::uint64_t clock) {
    for (int steps = 0;; ++steps) {
      const ClockFollower::Advice advice = follower.look(clock, stamp);
      EXPECT_GE(advice.stamp, stamp);
      missed += advice.missed;
      stamp = advice.stamp;
      if (!advice.is_due) return steps;
      advance();
      EXPECT_LE(stamp, clock);
    }
  }

  /// Advances time by a step or a manual reset, without regard to /clock.
  void advance() { stamp += kDt; }

  void reset(int times) {
    for (int i = 0; i < times; ++i) {
      advance();
      follower.restart();
    }
  }

  ClockFollower follower{kDt};
  std::uint64_t stamp = 0;
  std::uint64_t missed = 0;
};

/// A simulation that has followed /clock up to `clock`.
Simulated at(std::uint64_t clock) {
  Simulated simulated;
  simulated.look(clock);
  return simulated;
}

bool says(const Simulated& simulated, const std::string& words) {
  return simulated.follower.complaint().find(words) != std::string::npos;
}

TEST(ClockFollower, BeginsAtTheClock) {
  for (const std::uint64_t clock : {kDt, kSecond, 1000 * kSecond, 4'000'000'000 * kSecond}) {
    Simulated simulated;
    EXPECT_EQ(simulated.look(clock), 1);
    EXPECT_EQ(simulated.stamp, clock);
    EXPECT_EQ(simulated.missed, 0U);
    EXPECT_EQ(simulated.follower.complaint(), "");
  }
}

TEST(ClockFollower, AStepIsDueForEachDt) {
  Simulated simulated = at(kSecond);
  std::uint64_t clock = kSecond;
  int steps = 0;
  for (int i = 1; i <= 1000; ++i) {
    clock += 7 * kMillisecond;
    steps += simulated.look(clock);
    ASSERT_EQ(steps, i * 7 / 20);
    ASSERT_GT(simulated.stamp + kDt, clock);
  }
  EXPECT_EQ(simulated.missed, 0U);
  EXPECT_EQ(simulated.look(clock), 0) << "it stands still";
}

TEST(ClockFollower, AClockOfLongerStepsIsCaughtUpWith) {
  Simulated simulated = at(kSecond);
  EXPECT_EQ(simulated.look(kSecond + 5 * kDt), 5);
  EXPECT_EQ(simulated.look(kSecond + 10 * kDt), 5);
  EXPECT_EQ(simulated.missed, 0U);
}

TEST(ClockFollower, AJumpAheadIsASlipAndCounts) {
  Simulated simulated = at(kSecond);
  EXPECT_EQ(simulated.look(kSecond + 6 * kDt), 1);
  EXPECT_EQ(simulated.stamp, kSecond + 6 * kDt);
  EXPECT_EQ(simulated.missed, 5U);
  EXPECT_EQ(simulated.look(101 * kSecond + 7 * kMillisecond), 1);
  EXPECT_EQ(simulated.stamp, 101 * kSecond) << "a whole number of steps on";
  EXPECT_EQ(simulated.missed, 100U * 50 - 2);
  EXPECT_EQ(simulated.look(101 * kSecond + kDt), 1);
  EXPECT_EQ(simulated.missed, 100U * 50 - 2);
}

TEST(ClockFollower, WhatPassesInAPauseIsNotMissed) {
  Simulated simulated = at(kSecond);
  simulated.follower.restart();
  EXPECT_EQ(simulated.look(3 * kSecond), 1);
  EXPECT_EQ(simulated.stamp, 3 * kSecond);
  EXPECT_EQ(simulated.missed, 0U);
  EXPECT_EQ(simulated.look(5 * kSecond), 1);
  EXPECT_EQ(simulated.missed, 99U) << "of the second jump, which was no pause";
}

TEST(ClockFollower, ResetsBeforeTheFirstClockMissNothing) {
  Simulated simulated;
  simulated.reset(3);
  EXPECT_EQ(simulated.look(0), 0);
  EXPECT_EQ(simulated.look(1000 * kSecond), 1);
  EXPECT_EQ(simulated.stamp, 1000 * kSecond);
  EXPECT_EQ(simulated.missed, 0U);
}

TEST(ClockFollower, AResetIsNothingToComplainOf) {
  Simulated simulated = at(kSecond);
  simulated.reset(1);
  EXPECT_EQ(simulated.look(kSecond), 0);
  EXPECT_EQ(simulated.follower.complaint(), "") << "one dt ahead";
}

TEST(ClockFollower, WhoRanAheadWaitsSaysSoAndGoesOn) {
  Simulated simulated = at(kSecond);
  simulated.reset(500);
  for (std::uint64_t clock = kSecond; clock < 11 * kSecond; clock += kDt) {
    ASSERT_EQ(simulated.look(clock), 0);
    ASSERT_EQ(simulated.stamp, 11 * kSecond);
    ASSERT_EQ(says(simulated, "waits for /clock"), clock + kDt < 11 * kSecond) << clock;
  }
  EXPECT_EQ(simulated.look(11 * kSecond), 0);
  EXPECT_EQ(simulated.look(11 * kSecond + kDt), 1);
  EXPECT_EQ(simulated.missed, 0U);
}

TEST(ClockFollower, SaysHowFarBehindTheClockIs) {
  Simulated simulated = at(kSecond);
  simulated.reset(100);
  EXPECT_EQ(simulated.follower.complaint(), "") << "not before a look";
  simulated.look(kSecond + kSecond / 2);
  EXPECT_EQ(simulated.follower.complaint(), "waits for /clock, which is 1.50 s behind");
  simulated.follower.restart();
  EXPECT_EQ(simulated.follower.complaint(), "") << "a pause is no waiting";
}

TEST(ClockFollower, AClockThatWasSetBackIsCalledThat) {
  Simulated simulated = at(1000 * kSecond);
  EXPECT_EQ(simulated.look(5 * kSecond), 0);
  EXPECT_EQ(simulated.stamp, 1000 * kSecond);
  EXPECT_TRUE(says(simulated, "waits for /clock, which is 995.00 s behind"));
  EXPECT_TRUE(says(simulated, "set back by 995.00 s"));
  EXPECT_TRUE(says(simulated, "start this server again"));
  EXPECT_EQ(simulated.look(6 * kSecond), 0);
  EXPECT_TRUE(says(simulated, "set back by 994.00 s"));
  EXPECT_EQ(simulated.look(1000 * kSecond + kDt), 1);
  EXPECT_EQ(simulated.follower.complaint(), "");
  EXPECT_EQ(simulated.missed, 0U);
}

TEST(ClockFollower, AClockSetBackToZeroIsNotTakenForNone) {
  Simulated simulated = at(1000 * kSecond);
  simulated.look(0);
  EXPECT_TRUE(says(simulated, "set back by 1000.00 s"));
}

TEST(ClockFollower, AClockThatNobodyPublishesIsCalledThat) {
  using std::chrono::seconds;
  const std::chrono::steady_clock::time_point begin;
  const std::string words = "waits for /clock, which nobody publishes";
  Simulated simulated;
  simulated.follower.count(0, begin);
  simulated.look(0);
  EXPECT_EQ(simulated.follower.complaint(), "") << "it may be on its way";
  simulated.follower.count(0, begin + seconds(3));
  EXPECT_TRUE(says(simulated, words));
  EXPECT_TRUE(says(simulated, "publish_clock = true"));
  simulated.follower.restart();
  EXPECT_TRUE(says(simulated, words)) << "a reset does not mend it";
  simulated.follower.count(1, begin + seconds(4));
  EXPECT_EQ(simulated.follower.complaint(), "");
  simulated.look(kSecond);
  simulated.follower.count(0, begin + seconds(5));
  EXPECT_EQ(simulated.follower.complaint(), "") << "it may be started again";
  simulated.follower.count(0, begin + seconds(9));
  EXPECT_TRUE(says(simulated, words));
}

TEST(ClockFollower, TheFarthestTimesAreNoTrouble) {
  constexpr std::uint64_t kLast = ((std::uint64_t{1} << 32U) - 1) * kSecond + (kSecond - 1);
  Simulated simulated = at(kSecond);
  EXPECT_EQ(simulated.look(kLast), 1);
  EXPECT_EQ(simulated.stamp, kLast - kLast % kDt);
  EXPECT_EQ(simulated.look(kLast), 0);
  EXPECT_EQ(simulated.missed, (kLast - kSecond) / kDt - 1);
  EXPECT_EQ(simulated.look(1), 0);
  EXPECT_TRUE(says(simulated, "set back by 4294967296.00 s"));
}

TEST(ClockFollower, StampsGrowWhateverTheClockDoes) {
  std::mt19937_64 draws(1);
  std::uniform_int_distribution<std::uint64_t> any(0, 100 * kSecond);
  std::uniform_int_distribution<int> choice(0, 3);
  Simulated simulated;
  for (int i = 0; i < 10'000; ++i) {
    const std::uint64_t before = simulated.stamp;
    const int chosen = choice(draws);
    if (chosen == 0) simulated.reset(1);
    const int steps = simulated.look(any(draws));
    ASSERT_LE(steps, 5);
    ASSERT_EQ(simulated.stamp > before, steps > 0 || chosen == 0);
  }
}

}  // namespace
}  // namespace walker
