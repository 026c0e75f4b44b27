// Time reservations on a fast, blocked, failing or recovered fake master, and values of their
// parameter as servers and other programs write them.
#include "server/time/time_reservation.h"

#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <stdexcept>
#include <vector>

#include "error_message.h"
#include "server/gate.h"

namespace walker::test {
namespace {

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

xml_rpc::Value parsed(const std::string& xml) {
  return xml_rpc::parse_answer("<?xml version=\"1.0\"?><methodResponse><params><param>" + xml +
                               "</param></params></methodResponse>");
}

std::string pair(const std::string& one, const std::string& other) {
  return "<value><array><data><value>" + one + "</value><value>" + other +
         "</value></data></array></value>";
}

TEST(ReservedUntil, SurvivesARoundTrip) {
  for (const std::uint64_t time :
       {std::uint64_t{0}, std::uint64_t{1}, kSecond - 1, 17 * kSecond + 20'000'000,
        2147483647 * kSecond + 5, 2147483648 * kSecond, 4294967295 * kSecond + kSecond - 1}) {
    EXPECT_EQ(read_reserved_until(parsed(to_reserved_until(time))), time);
  }
}

TEST(ReservedUntil, AcceptsTheTypesOfRosparamAndLaunchFiles) {
  EXPECT_EQ(read_reserved_until(parsed(pair("<int>3</int>", "<int>4</int>"))), 3 * kSecond + 4);
  EXPECT_EQ(read_reserved_until(parsed(pair("<double>3.0</double>", "<i4>0</i4>"))), 3 * kSecond);
  EXPECT_EQ(read_reserved_until(parsed(pair("<string>3.0e0</string>", "4e0"))), 3 * kSecond + 4);
}

TEST(ReservedUntil, RejectsOtherValues) {
  const struct {
    std::string xml, text;
  } cases[] = {
      {"<value><string>soon</string></value>", "\"soon\""},
      {"<value>" + std::string(200, 'x') + "</value>", "\"" + std::string(60, 'x') + "...\""},
      {"<value><int>5</int></value>", "5"},
      {"<value><boolean>1</boolean></value>", "1"},
      {"<value><array><data></data></array></value>", "[]"},
      {"<value><struct><member><name>s</name><value><i4>1</i4></value></member></struct></value>",
       "{1}"},
      {"<value><array><data><value><i4>5</i4></value></data></array></value>", "[5]"},
      {"<value><array><data><value>1</value><value>2</value><value>3</value><value>4</value>"
       "<value>5</value><value>6</value></data></array></value>",
       R"(["1", "2", "3", "4", ...])"},
      {pair("<i4>-1</i4>", "<i4>0</i4>"), "[-1, 0]"},
      {pair("<i4>5</i4>", "<i4>-1</i4>"), "[5, -1]"},
      {pair("<i4>5</i4>", "<i4>1000000000</i4>"), "[5, 1000000000]"},
      {pair("<i8>4294967296</i8>", "<i4>0</i4>"), "[4294967296, 0]"},
      {pair("<i8>9223372036854775807</i8>", "<i4>0</i4>"), "[9223372036854775807, 0]"},
      {pair("<double>nan</double>", "<i4>0</i4>"), "[nan, 0]"},
      {pair("<double>inf</double>", "<i4>0</i4>"), "[inf, 0]"},
      {pair("<double>-0.5</double>", "<i4>0</i4>"), "[-0.5, 0]"},
      {pair("<double>1e300</double>", "<i4>0</i4>"), "[1e300, 0]"},
      {pair("<double>2.5</double>", "<i4>0</i4>"), "[2.5, 0]"},
      {pair("<double>soon</double>", "<i4>0</i4>"), "[soon, 0]"},
      {pair("<boolean>1</boolean>", "<i4>0</i4>"), "[1, 0]"},
      {pair("<string>5 s</string>", "<i4>0</i4>"), R"(["5 s", 0])"},
      {pair("<string>2.5e0</string>", "<i4>0</i4>"), R"(["2.5e0", 0])"},
  };
  for (const auto& [xml, text] : cases) {
    EXPECT_EQ(message_of<std::invalid_argument>([&xml = xml] { read_reserved_until(parsed(xml)); }),
              "parameter /walker_sim_clock/reserved_until = " + text +
                  ": must be [seconds, nanoseconds], integers in [0, 4294967295] and [0, "
                  "999999999]; a server writes it. To restart time at 0: rosparam delete "
                  "/walker_sim_clock/reserved_until");
  }
}

}  // namespace
}  // namespace walker::test
