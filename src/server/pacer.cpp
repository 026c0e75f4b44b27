#include "server/pacer.h"

namespace walker {
namespace {

Pacer::Clock::duration period(double dt, double real_time_factor) {
  if (real_time_factor == 0) return Pacer::Clock::duration::zero();
  return std::chrono::duration_cast<Pacer::Clock::duration>(
      std::chrono::duration<double>(dt / real_time_factor));
}

}  // namespace

Pacer::Pacer(double dt, double real_time_factor) : period_(period(dt, real_time_factor)) {}

void Pacer::restart(Clock::time_point now) { deadline_ = now + period_; }

void Pacer::step_made(Clock::time_point now) {
  deadline_ += period_;
  if (as_fast_as_it_goes() || now < deadline_) return;
  // More than a period late: what was missed stays missed.
  ++missed_;
  deadline_ = now + period_;
}

}  // namespace walker
