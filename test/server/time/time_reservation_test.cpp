// Time reservations on a fast, blocked, failing or recovered fake master.
#include "server/time/time_reservation.h"

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/gate.h"

namespace walker {
namespace {

using test::Gate;

constexpr std::uint64_t kSecond = 1'000'000'000;
constexpr std::uint64_t kBegin = 100 * kSecond;
constexpr std::uint64_t kEnd = std::numeric_limits<std::uint64_t>::max();

/// Fake master: records reservations; a test can block them or make them fail.
class FakeMaster {
 public:
  TimeReservation::Write write() {
    return [this](std::uint64_t until) {
      gate.pass();
      const std::lock_guard<std::mutex> lock(mutex_);
      reserved_.push_back(until);
      changed_.notify_all();
      if (is_failing_) throw std::runtime_error("timed out");
    };
  }

  void set_failing(bool is_failing) {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_failing_ = is_failing;
  }

  /// Waits for `count` reservations and returns all of them.
  std::vector<std::uint64_t> reservations(std::size_t count) {
    std::unique_lock<std::mutex> lock(mutex_);
    constexpr std::chrono::seconds kTimeout{30};  // reached only by a failing test
    EXPECT_TRUE(changed_.wait_for(lock, kTimeout, [&] { return reserved_.size() >= count; }));
    return reserved_;
  }

  Gate gate;

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::uint64_t> reserved_;
  bool is_failing_ = false;
};

class TimeReservationTest : public testing::Test {
 protected:
  TimeReservationTest() { master_.gate.open(); }
  ~TimeReservationTest() override { master_.gate.open(); }

  void begin(std::uint64_t end = kEnd) {
    reservation_ = std::make_unique<TimeReservation>(kBegin, end, master_.write());
  }

  /// Waits until there is a complaint, or none, and returns it.
  std::string wait_for_complaint(bool is_wanted) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (reservation_->complaint().empty() == is_wanted) {
      if (std::chrono::steady_clock::now() > until) {
        ADD_FAILURE() << reservation_->complaint();
        break;
      }
      std::this_thread::yield();
    }
    return reservation_->complaint();
  }

  FakeMaster master_;
  std::unique_ptr<TimeReservation> reservation_;
};

TEST_F(TimeReservationTest, ReservesTenSecondsFirst) {
  begin();
  EXPECT_EQ(master_.reservations(1), std::vector<std::uint64_t>{kBegin + 10 * kSecond});
  EXPECT_EQ(reservation_->complaint(), "");
}

TEST_F(TimeReservationTest, RenewsWhenHalfIsUsed) {
  begin();
  for (std::uint64_t now = kBegin; now <= kBegin + 5 * kSecond; now += kSecond) {
    reservation_->use(now);
  }
  EXPECT_EQ(master_.reservations(1).size(), 1U);
  reservation_->use(kBegin + 6 * kSecond);
  EXPECT_GE(master_.reservations(2).back(), kBegin + 16 * kSecond);
}

TEST_F(TimeReservationTest, StaysAheadOfAFastUser) {
  begin();
  for (std::uint64_t now = kBegin; now < kBegin + 10000 * kSecond; now += kSecond / 50) {
    reservation_->use(now);
    ASSERT_GE(master_.reservations(1).back(), now);
  }
}

TEST_F(TimeReservationTest, ReleasesUnusedTime) {
  begin();
  reservation_->use(kBegin + kSecond);
  reservation_.reset();
  EXPECT_EQ(master_.reservations(2).back(), kBegin + kSecond);
}

TEST_F(TimeReservationTest, WaitsOnlyOnceForASilentMaster) {
  begin();
  master_.gate.close();
  for (std::uint64_t now = kBegin; now < kBegin + 1000 * kSecond; now += kSecond / 50) {
    reservation_->use(now);
  }
  EXPECT_EQ(master_.reservations(1).size(), 1U);
  EXPECT_EQ(reservation_->complaint(), "") << "no attempt has failed yet";
  master_.gate.open();
  reservation_->use(kBegin + 1001 * kSecond);
  reservation_->use(kBegin + 1002 * kSecond);
  while (master_.reservations(1).back() < kBegin + 1002 * kSecond) master_.reservations(2);
  EXPECT_EQ(reservation_->complaint(), "");
}

TEST_F(TimeReservationTest, ReservesAnHourAfterAFailure) {
  begin();
  master_.set_failing(true);
  reservation_->use(kBegin + 8 * kSecond);
  EXPECT_EQ(wait_for_complaint(true),
            "the ROS master does not answer (timed out): simulation time is reserved up to 110.00 "
            "s only, and a server that is started after this one may begin there");
  EXPECT_GE(master_.reservations(3)[2], kBegin + 3608 * kSecond);
  reservation_->use(kBegin + 5000 * kSecond);
  const std::vector<std::uint64_t> failed = master_.reservations(4);
  EXPECT_GE(failed[3], kBegin + 8600 * kSecond) << "an hour ahead of the used time";
  master_.set_failing(false);
  EXPECT_EQ(wait_for_complaint(false), "");
  const std::vector<std::uint64_t> answered = master_.reservations(6);
  EXPECT_GE(answered[4], kBegin + 8600 * kSecond);
  EXPECT_LT(answered[5], answered[4]) << "a short reservation again";
  EXPECT_GT(answered[5], kBegin + 5000 * kSecond);
}

TEST_F(TimeReservationTest, RecoversFromAFailedFirstAttempt) {
  master_.set_failing(true);
  begin();
  EXPECT_NE(reservation_->complaint().find("up to 100.00 s"), std::string::npos);
  reservation_->use(kBegin + kSecond);
  master_.set_failing(false);
  EXPECT_EQ(wait_for_complaint(false), "");
}

TEST_F(TimeReservationTest, StopsAtTheEndOfTime) {
  const std::uint64_t end = kBegin + 3 * kSecond;
  begin(end);
  for (std::uint64_t now = kBegin; now <= end; now += kSecond / 50) reservation_->use(now);
  EXPECT_EQ(master_.reservations(1), std::vector<std::uint64_t>{end}) << "and is reserved once";
}

}  // namespace
}  // namespace walker
