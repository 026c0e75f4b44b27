#include "server/time/clock_follower.h"

#include <algorithm>
#include <iomanip>
#include <utility>

#include "base/shortest_text.h"

namespace walker {
namespace {

// If /clock has advanced by more steps than this, all but one are skipped.
constexpr std::uint64_t kMaxStepsToCatchUp = 5;

// Before that, a publisher may be starting or restarting.
constexpr std::chrono::seconds kMaxWithoutPublisher{3};

}  // namespace

void ClockFollower::restart() {
  has_restarted_ = true;
  behind_ = 0;
}

ClockFollower::Decision ClockFollower::update(std::uint64_t clock, std::uint64_t stamp) {
  newest_ = std::max(newest_, clock);
  if (newest_ == 0) return {stamp, 0, false};
  const bool has_restarted = std::exchange(has_restarted_, false);
  clock_ = clock;
  behind_ = stamp > clock ? stamp - clock : 0;
  const std::uint64_t due = behind_ > 0 ? 0 : (clock - stamp) / dt_;
  Decision decision{stamp, 0, due > 0};
  if (due > (has_restarted ? 1 : kMaxStepsToCatchUp)) {
    const std::uint64_t skipped = due - 1;
    decision.stamp += skipped * dt_;
    decision.missed = has_restarted ? 0 : skipped;
  }
  return decision;
}

void ClockFollower::record_publishers(std::size_t publishers,
                                      std::chrono::steady_clock::time_point now) {
  if (publishers > 0) {
    unpublished_since_.reset();
  } else if (!unpublished_since_) {
    unpublished_since_ = now;
  }
  is_unpublished_ = unpublished_since_ && now - *unpublished_since_ >= kMaxWithoutPublisher;
}

std::string ClockFollower::complaint() const {
  if (is_unpublished_) {
    return "waits for /clock, which has no publisher: start the server that publishes it, or set "
           "publish_clock = true for this one";
  }
  if (behind_ <= dt_) return "";
  constexpr double kSeconds = 1e-9;
  ClassicStream text;
  text << std::fixed << std::setprecision(2);
  text << "waits for /clock, which is " << static_cast<double>(behind_) * kSeconds << " s behind";
  if (clock_ < newest_) {
    text << "; it was set back by " << static_cast<double>(newest_ - clock_) * kSeconds
         << " s: start this server again to follow it from there";
  }
  return text.str();
}

}  // namespace walker
