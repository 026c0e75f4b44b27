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
constexpr int kMaxPause = 4096;

class SpinWaitTest : public testing::Test {
 protected:
  SpinWaitTest() { FakeClock::tick = nanoseconds(1000); }

  /// Waits for an event that comes within the limit. @return whether the wait polled
  bool wait_briefly() {
    int checks = 0;
    return spin_.poll([&checks] { return ++checks == 3; });
  }

  /// Waits for an event that comes too late. @return whether the wait polled
  bool wait_long() {
    bool has_polled = false;
    EXPECT_FALSE(spin_.poll([&] {
      has_polled = true;
      return false;
    }));
    return has_polled;
  }

  void stop_polling() {
    while (wait_long()) {
    }
  }

  /// @return the number of waits that block at once until one polls, of `wait`'s kind
  template <typename Wait>
  int blocked_before_trial(const Wait& wait) {
    int blocked = 0;
    while (!wait() && blocked < 2 * kMaxPause) ++blocked;
    return blocked;
  }

  SpinWait<FakeClock> spin_{kLimit};
};

TEST_F(SpinWaitTest, PollsUntilTheEvent) {
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(wait_briefly());
}

TEST_F(SpinWaitTest, PollsNoLongerThanTheLimit) {
  const nanoseconds before = FakeClock::time;
  EXPECT_TRUE(wait_long());
  EXPECT_LE(FakeClock::time - before, kLimit + 2 * FakeClock::tick);
}

TEST_F(SpinWaitTest, NeverPollsWithoutALimit) {
  spin_ = SpinWait<FakeClock>(nanoseconds(0));
  EXPECT_FALSE(wait_long());
  EXPECT_FALSE(wait_briefly());
}

TEST_F(SpinWaitTest, BlocksAtOnceAfterSomeLongWaits) {
  EXPECT_TRUE(wait_briefly());
  int polled = 0;
  while (wait_long()) ++polled;
  EXPECT_GE(polled, 2);
  EXPECT_LE(polled, 5);
}

TEST_F(SpinWaitTest, OneLongWaitAmongBriefOnesChangesNothing) {
  for (int i = 0; i < 100; ++i) {
    EXPECT_TRUE(wait_long());
    for (int j = 0; j < 8; ++j) EXPECT_TRUE(wait_briefly());
  }
}

TEST_F(SpinWaitTest, TriesAgainLessAndLessOften) {
  stop_polling();
  int expected = 16;
  for (int trial = 0; trial < 12; ++trial) {
    // The wait that showed that polling has stopped was the first blocked one of the first pause.
    const int already = trial == 0 ? 1 : 0;
    EXPECT_EQ(blocked_before_trial([this] { return wait_long(); }) + already, expected - 1);
    expected = std::min(2 * expected, kMaxPause);
  }
}

TEST_F(SpinWaitTest, PollsAgainAfterOneTrialThatPaid) {
  stop_polling();
  blocked_before_trial([this] { return wait_briefly(); });
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(wait_briefly());
}

TEST_F(SpinWaitTest, StopsWhereAnotherThreadNeedsTheCore) {
  FakeClock::tick = nanoseconds(3000000);  // a yield that took so long ran another thread
  const nanoseconds before = FakeClock::time;
  EXPECT_TRUE(wait_long());
  EXPECT_LE(FakeClock::time - before, 2 * FakeClock::tick);
  stop_polling();
  EXPECT_FALSE(wait_briefly());
}

/// On one core the yield runs the peer, which may take long and then has sent the event.
TEST_F(SpinWaitTest, PollsWhereThePeerNeedsTheCore) {
  FakeClock::tick = nanoseconds(20000);
  for (int i = 0; i < 100; ++i) {
    EXPECT_TRUE(spin_.pays());
    EXPECT_TRUE(spin_.poll([] { return true; }));
  }
}

TEST_F(SpinWaitTest, StopsIfEventsComeLaterThanTheLimit) {
  FakeClock::tick = kLimit + nanoseconds(1);
  int polled = 0;
  while (spin_.poll([] { return true; })) ++polled;
  EXPECT_LE(polled, 5);
  EXPECT_FALSE(spin_.pays());
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
