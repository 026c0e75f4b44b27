// ClockFollower on synthetic times.
#include "server/time/clock_follower.h"

#include <gtest/gtest.h>

#include <random>

namespace walker {
namespace {

constexpr std::uint64_t kMillisecond = 1'000'000;
constexpr std::uint64_t kSecond = 1000 * kMillisecond;
constexpr std::uint64_t kDt = 20 * kMillisecond;

/// A simulation that steps as the follower decides.
class Simulated {
 public:
  /// Makes the steps that are due and returns their number.
  int follow(std::uint64_t clock) {
    for (int steps = 0;; ++steps) {
      const ClockFollower::Decision decision = follower.update(clock, stamp);
      EXPECT_GE(decision.stamp, stamp);
      missed += decision.missed;
      stamp = decision.stamp;
      if (!decision.is_due) return steps;
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
  simulated.follow(clock);
  return simulated;
}

bool says(const Simulated& simulated, const std::string& words) {
  return simulated.follower.complaint().find(words) != std::string::npos;
}

TEST(ClockFollower, StartsAtTheClock) {
  for (const int resets : {0, 3}) {  // before the first /clock
    for (const std::uint64_t clock : {4 * kDt, kSecond, 1000 * kSecond, 4'000'000'000 * kSecond}) {
      Simulated simulated;
      simulated.reset(resets);
      EXPECT_EQ(simulated.follow(0), 0);
      EXPECT_EQ(simulated.follow(clock), 1);
      EXPECT_EQ(simulated.stamp, clock);
      EXPECT_EQ(simulated.missed, 0U);
      EXPECT_EQ(simulated.follower.complaint(), "");
    }
  }
}

TEST(ClockFollower, StepsOncePerDt) {
  Simulated simulated = at(kSecond);
  std::uint64_t clock = kSecond;
  int steps = 0;
  for (int i = 1; i <= 1000; ++i) {
    clock += 7 * kMillisecond;
    steps += simulated.follow(clock);
    ASSERT_EQ(steps, i * 7 / 20);
    ASSERT_GT(simulated.stamp + kDt, clock);
  }
  EXPECT_EQ(simulated.missed, 0U);
  EXPECT_EQ(simulated.follow(clock), 0) << "/clock stands still";
}

TEST(ClockFollower, CatchesUpFiveStepsAndSkipsMore) {
  Simulated simulated = at(kSecond);
  EXPECT_EQ(simulated.follow(kSecond + 5 * kDt), 5);
  EXPECT_EQ(simulated.missed, 0U);
  EXPECT_EQ(simulated.follow(kSecond + 11 * kDt), 1);
  EXPECT_EQ(simulated.stamp, kSecond + 11 * kDt);
  EXPECT_EQ(simulated.missed, 5U);
  EXPECT_EQ(simulated.follow(101 * kSecond + 7 * kMillisecond), 1);
  EXPECT_EQ(simulated.stamp, 101 * kSecond) << "skips whole steps";
  EXPECT_EQ(simulated.missed, 100U * 50 - 7);
  EXPECT_EQ(simulated.follow(101 * kSecond + kDt), 1);
  EXPECT_EQ(simulated.missed, 100U * 50 - 7);
}

TEST(ClockFollower, CountsNoStepAsMissedAfterARestart) {
  Simulated simulated = at(kSecond);
  simulated.follower.restart();
  EXPECT_EQ(simulated.follow(3 * kSecond), 1);
  EXPECT_EQ(simulated.stamp, 3 * kSecond);
  EXPECT_EQ(simulated.missed, 0U);
  EXPECT_EQ(simulated.follow(5 * kSecond), 1);
  EXPECT_EQ(simulated.missed, 99U) << "the second jump was no pause";
}

TEST(ClockFollower, WaitsForTheClockAfterResets) {
  Simulated simulated = at(kSecond);
  simulated.reset(500);
  for (std::uint64_t clock = kSecond; clock < 11 * kSecond; clock += kDt) {
    ASSERT_EQ(simulated.follow(clock), 0);
    ASSERT_EQ(simulated.stamp, 11 * kSecond);
    ASSERT_EQ(says(simulated, "waits for /clock"), clock + kDt < 11 * kSecond) << clock;
  }
  EXPECT_EQ(simulated.follow(11 * kSecond), 0);
  EXPECT_EQ(simulated.follow(11 * kSecond + kDt), 1);
  EXPECT_EQ(simulated.missed, 0U);
}

TEST(ClockFollower, ReportsHowFarTheClockIsBehind) {
  Simulated simulated = at(kSecond);
  simulated.reset(1);
  EXPECT_EQ(simulated.follow(kSecond), 0);
  EXPECT_EQ(simulated.follower.complaint(), "") << "one dt is no lag";
  simulated.reset(99);
  EXPECT_EQ(simulated.follower.complaint(), "") << "not before an update";
  simulated.follow(kSecond + kSecond / 2);
  EXPECT_EQ(simulated.follower.complaint(), "waits for /clock, which is 1.50 s behind");
  simulated.follower.restart();
  EXPECT_EQ(simulated.follower.complaint(), "");
}

TEST(ClockFollower, ReportsAClockThatWasSetBack) {
  Simulated simulated = at(1000 * kSecond);
  EXPECT_EQ(simulated.follow(5 * kSecond), 0);
  EXPECT_EQ(simulated.stamp, 1000 * kSecond);
  EXPECT_TRUE(says(simulated, "waits for /clock, which is 995.00 s behind"));
  EXPECT_TRUE(says(simulated, "set back by 995.00 s"));
  EXPECT_TRUE(says(simulated, "start this server again"));
  EXPECT_EQ(simulated.follow(6 * kSecond), 0);
  EXPECT_TRUE(says(simulated, "set back by 994.00 s"));
  EXPECT_EQ(simulated.follow(0), 0);
  EXPECT_TRUE(says(simulated, "set back by 1000.00 s"));
  EXPECT_EQ(simulated.follow(1000 * kSecond + kDt), 1);
  EXPECT_EQ(simulated.follower.complaint(), "");
  EXPECT_EQ(simulated.missed, 0U);
}

TEST(ClockFollower, ReportsAMissingPublisherAfterThreeSeconds) {
  using std::chrono::seconds;
  const std::chrono::steady_clock::time_point begin;
  const std::string words = "waits for /clock, which has no publisher";
  Simulated simulated;
  simulated.follower.record_publishers(0, begin);
  simulated.follow(0);
  EXPECT_EQ(simulated.follower.complaint(), "") << "it may be starting";
  simulated.follower.record_publishers(0, begin + seconds(3));
  EXPECT_TRUE(says(simulated, words));
  EXPECT_TRUE(says(simulated, "publish_clock = true"));
  simulated.follower.restart();
  EXPECT_TRUE(says(simulated, words));
  simulated.follower.record_publishers(1, begin + seconds(4));
  EXPECT_EQ(simulated.follower.complaint(), "");
  simulated.follow(kSecond);
  simulated.follower.record_publishers(0, begin + seconds(5));
  EXPECT_EQ(simulated.follower.complaint(), "") << "it may be restarting";
  simulated.follower.record_publishers(0, begin + seconds(9));
  EXPECT_TRUE(says(simulated, words));
}

TEST(ClockFollower, ReachesTheEndOfRosTime) {
  constexpr std::uint64_t kLast = ((std::uint64_t{1} << 32U) - 1) * kSecond + (kSecond - 1);
  Simulated simulated = at(kSecond);
  EXPECT_EQ(simulated.follow(kLast), 1);
  EXPECT_EQ(simulated.stamp, kLast - kLast % kDt);
  EXPECT_EQ(simulated.follow(kLast), 0);
  EXPECT_EQ(simulated.missed, (kLast - kSecond) / kDt - 1);
  EXPECT_EQ(simulated.follow(1), 0);
  EXPECT_TRUE(says(simulated, "set back by 4294967296.00 s"));
}

TEST(ClockFollower, NeverDecreasesStampsWithRandomClocks) {
  std::mt19937_64 draws(1);
  std::uniform_int_distribution<std::uint64_t> any(0, 100 * kSecond);
  std::uniform_int_distribution<int> choice(0, 3);
  Simulated simulated;
  for (int i = 0; i < 10'000; ++i) {
    const std::uint64_t before = simulated.stamp;
    const int chosen = choice(draws);
    if (chosen == 0) simulated.reset(1);
    const int steps = simulated.follow(any(draws));
    ASSERT_LE(steps, 5);
    ASSERT_EQ(simulated.stamp > before, steps > 0 || chosen == 0);
  }
}

}  // namespace
}  // namespace walker
