#include "base/spin_wait.h"

#include <algorithm>
#include <chrono>

#include <gtest/gtest.h>

namespace walker {
namespace {

using std::chrono::nanoseconds;

/// Each reading is `tick` later than the one before.
struct FakeClock {
  using time_point = std::chrono::time_point<FakeClock, nanoseconds>;
  static time_point now() { return time_point(time += tick); }
  static inline nanoseconds time{};
  static inline nanoseconds tick{};
};

constexpr nanoseconds kLimit{50000};

class SpinWaitTest : public testing::Test {
 protected:
  SpinWaitTest() { FakeClock::tick = nanoseconds(1000); }

  /// Waits for an event that polling and blocking notice after so long. @return whether it polled
  bool wait(nanoseconds polled, nanoseconds blocked) {
    const nanoseconds begin = FakeClock::time;
    bool has_polled = false;
    const bool has_come = spin_.poll([&] {
      has_polled = true;
      return FakeClock::time - begin >= polled;
    });
    if (!has_come) {
      FakeClock::time = std::max(FakeClock::time, begin + (has_polled ? polled : blocked));
      spin_.finish();
    }
    return has_polled;
  }

  /// @return how many of these waits polled
  int count(int waits, nanoseconds polled, nanoseconds blocked) {
    int has_polled = 0;
    for (int i = 0; i < waits; ++i) has_polled += wait(polled, blocked) ? 1 : 0;
    return has_polled;
  }

  SpinWait<FakeClock> spin_{kLimit};
};

constexpr nanoseconds kBrief{10000};
constexpr nanoseconds kWoken{30000};  // a brief wait and the time to wake
constexpr nanoseconds kEndless{1000000000};

TEST_F(SpinWaitTest, PollsWhereThatIsFasterAndSeldomTriesToBlock) {
  EXPECT_GE(count(100000, kBrief, kWoken), 99000);
  EXPECT_TRUE(spin_.pays());
}

TEST_F(SpinWaitTest, PollsNoLongerThanTheLimit) {
  const nanoseconds before = FakeClock::time;
  EXPECT_FALSE(spin_.poll([] { return false; }));
  EXPECT_LE(FakeClock::time - before, kLimit + 2 * FakeClock::tick);
}

TEST_F(SpinWaitTest, NeverPollsWithoutALimit) {
  spin_ = SpinWait<FakeClock>(nanoseconds(0));
  EXPECT_EQ(count(100000, kBrief, kWoken), 0);
}

TEST_F(SpinWaitTest, BlocksAtOnceAfterSomeLongWaits) {
  EXPECT_EQ(count(50, kBrief, kWoken), 50);
  const int polled = count(50, kEndless, kEndless);
  EXPECT_GE(polled, 2);
  EXPECT_LE(polled, 5);
  EXPECT_LE(count(100000, kEndless, kEndless), 200) << "trials that become rare";
}

TEST_F(SpinWaitTest, OneLongWaitAmongBriefOnesChangesNothing) {
  for (int i = 0; i < 100; ++i) {
    count(1, kEndless, kEndless);
    count(8, kBrief, kWoken);
    EXPECT_TRUE(spin_.pays());
  }
}

/// As where the peer waits for this core while this thread polls.
TEST_F(SpinWaitTest, BlocksWhereThatIsFaster) {
  EXPECT_LE(count(1000, kWoken, kBrief), 200);
  EXPECT_LE(count(100000, kWoken, kBrief), 300);
}

TEST_F(SpinWaitTest, PollsAgainOnceThatIsFaster) {
  count(100, kEndless, kEndless);
  EXPECT_GE(count(100000, kBrief, kWoken), 90000);
}

TEST(SpinLimit, IsMeasuredOnceUnlessGiven) {
  const auto measured = spin_limit(kMeasuredSpin);
  EXPECT_GE(measured.count(), 50);
  EXPECT_LE(measured.count(), 1000);
  EXPECT_EQ(spin_limit(kMeasuredSpin), measured);
  EXPECT_EQ(spin_limit(0).count(), 0);
  EXPECT_EQ(spin_limit(7).count(), 7);
}

}  // namespace
}  // namespace walker
