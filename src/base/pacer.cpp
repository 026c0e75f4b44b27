#include "base/pacer.h"

#include <algorithm>
#include <cmath>

namespace walker {
namespace {

Pacer::Clock::duration planned_period(double dt, double real_time_factor) {
  using Duration = Pacer::Clock::duration;
  if (real_time_factor == 0) return Duration::zero();
  // Small factors would overflow the clock's range; short steps would round to zero.
  const std::chrono::duration<double, Duration::period> exact =
      std::min(std::chrono::duration<double>(dt / real_time_factor),
               std::chrono::duration<double>(std::chrono::hours(24 * 365)));
  return std::max(Duration(std::llround(exact.count())), Duration(1));
}

}  // namespace

Pacer::Pacer(double dt, double real_time_factor)
    : dt_(dt), real_time_factor_(real_time_factor), period_(planned_period(dt, real_time_factor)) {}

void Pacer::set_real_time_factor(double factor, Clock::time_point now) {
  const Clock::time_point last_beginning = deadline_ - period_;
  real_time_factor_ = factor;
  period_ = planned_period(dt_, factor);
  deadline_ = std::max(last_beginning + period_, now);
}

void Pacer::restart(Clock::time_point now) { deadline_ = now + period_; }

std::uint64_t Pacer::step_begins(Clock::time_point now) {
  const Clock::duration late = now - deadline_;
  if (period_ == Clock::duration::zero()) {
    deadline_ = now;
    return 0;
  }
  if (late < period_) {
    deadline_ += period_;
    return 0;
  }
  deadline_ = now + period_;
  return static_cast<std::uint64_t>(late / period_);
}

}  // namespace walker
