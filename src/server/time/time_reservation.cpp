#include "server/time/time_reservation.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>

#include <ros/console.h>

#include "base/parameter_text.h"
#include "base/printable_text.h"
#include "base/shortest_text.h"

namespace walker {
namespace {

using xml_rpc::Value;

constexpr std::uint64_t kPerSecond = 1'000'000'000;  // [ns/s]
constexpr double kWallSecondsAhead = 20;             // renewed once half of it is used
// In an outage asks for an hour: a stopped master may execute the call after its caller has gone.
constexpr double kWallSecondsAheadInOutage = 3600;
constexpr double kMinAhead = 10;   // [s]
constexpr double kMaxAhead = 1e6;  // [s]

constexpr std::chrono::milliseconds kMaxWait{200};
// Pauses between attempts, long because each may stay in the queue of a stopped master.
constexpr std::chrono::milliseconds kMinPause{1000};
constexpr std::chrono::milliseconds kMaxPause{5000};

constexpr double kLastSecond = 4294967295.0;  // 2^32 - 1, where ROS time ends
constexpr double kLastNanosecond = 999999999.0;

/// The value if it is an integer in [0, last]; else none.
std::optional<std::uint64_t> to_integer(const Value& value, double last) {
  const bool is_number = value.kind == Value::Kind::integer ||
                         value.kind == Value::Kind::floating ||
                         value.kind == Value::Kind::text;  // YAML 1.1 reads 1.0e3 as a string
  const std::optional<double> number = is_number ? parse_number(value.text) : std::nullopt;
  if (!number || !(*number >= 0 && *number <= last) || std::floor(*number) != *number) {
    return std::nullopt;
  }
  return static_cast<std::uint64_t>(*number);
}

/// Truncated text for an error message.
std::string to_text(const Value& value) {  // NOLINT(misc-no-recursion): the parser bounds depths
  constexpr std::size_t kMaxBytes = 60;
  constexpr std::size_t kMaxElements = 4;
  if (value.kind == Value::Kind::text) {
    return "\"" + value.text.substr(0, kMaxBytes) +
           (value.text.size() > kMaxBytes ? "...\"" : "\"");
  }
  const bool is_structure = value.kind == Value::Kind::structure;
  if (value.kind != Value::Kind::array && !is_structure) return value.text.substr(0, kMaxBytes);
  std::string text;
  for (std::size_t i = 0; i < value.elements.size() && i <= kMaxElements; ++i) {
    text += (i > 0 ? ", " : "") + (i < kMaxElements ? to_text(value.elements[i]) : "...");
  }
  return is_structure ? "{" + text + "}" : "[" + text + "]";
}

}  // namespace

std::uint64_t read_reserved_until(const Value& value) {
  if (value.kind == Value::Kind::array && value.elements.size() == 2) {
    const auto seconds = to_integer(value.elements[0], kLastSecond);
    const auto nanoseconds = to_integer(value.elements[1], kLastNanosecond);
    if (seconds && nanoseconds) return *seconds * kPerSecond + *nanoseconds;
  }
  throw std::invalid_argument(
      std::string("parameter ") + kReservedUntil + " = " + to_text(value) +
      ": must be [seconds, nanoseconds], integers in [0, 4294967295] and [0, 999999999]; a server "
      "writes it. To restart time at 0: rosparam delete " +
      kReservedUntil);
}

std::string to_reserved_until(std::uint64_t time) {
  const auto wrapped = [](const std::string& type, const std::string& text) {
    return "<value><" + type + ">" + text + "</" + type + "></value>";
  };
  const std::uint64_t seconds = time / kPerSecond;
  // XML-RPC has only signed 32-bit integers.
  const bool is_integer = seconds <= std::numeric_limits<std::int32_t>::max();
  return "<value><array><data>" +
         (is_integer ? wrapped("i4", std::to_string(seconds))
                     : wrapped("double", std::to_string(seconds) + ".0")) +
         wrapped("i4", std::to_string(time % kPerSecond)) + "</data></array></value>";
}

TimeReservation::TimeReservation(std::uint64_t begin, std::uint64_t end, Write write)
    : end_(end),
      write_(std::move(write)),
      now_(begin),
      renew_from_(begin),
      used_(begin),
      reserved_(begin),
      asked_(begin),
      paced_from_(begin),
      paced_at_(Clock::now()),
      thread_([this] { run(); }) {
  std::unique_lock<std::mutex> lock(mutex_);
  settled_.wait(lock, [this] { return !is_wanted_ || !failure_.empty(); });
}

TimeReservation::~TimeReservation() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_over_ = true;
  }
  wanted_.notify_one();
  thread_.join();
  [[maybe_unused]] const std::string failure = attempt(now_);  // a failure leaves a gap
}

void TimeReservation::use(std::uint64_t now) {
  now_ = now;
  if (now <= renew_from_.load(std::memory_order_relaxed)) return;
  std::unique_lock<std::mutex> lock(mutex_);
  used_ = now;
  if (!std::exchange(is_wanted_, true)) wanted_.notify_one();
  if (now <= reserved_ || has_waited_ || !failure_.empty()) return;
  settled_.wait_for(lock, kMaxWait, [&] { return now <= reserved_ || !failure_.empty(); });
  has_waited_ = now > reserved_;
}

std::string TimeReservation::complaint() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return failure_.empty() ? "" : describe_failure();
}

std::string TimeReservation::describe_failure() const {
  return "the ROS master does not answer (" + failure_ + "): simulation time is reserved up to " +
         fixed_text(static_cast<double>(reserved_) / kPerSecond, 2) +
         " s only, and a server that is started after this one may begin there";
}

void TimeReservation::run() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    wanted_.wait(lock, [this] { return is_over_ || is_wanted_; });
    if (is_over_) return;
    const std::uint64_t from = used_;
    const Clock::time_point at = Clock::now();
    asked_ = next_end();
    const std::uint64_t until = asked_;
    const bool was_silent = !failure_.empty();
    lock.unlock();
    const std::string failure = attempt(until);
    lock.lock();
    if (failure.empty()) {
      record_success(from, until, at);
    } else {
      if (was_silent) pause_ = std::clamp(2 * pause_, kMinPause, kMaxPause);
      failure_ = failure;
    }
    const std::string warning = failure.empty() || was_silent ? "" : describe_failure();
    settled_.notify_one();
    lock.unlock();
    if (!warning.empty()) ROS_WARN_STREAM("Stepping continues, but " << warning);
    if (failure.empty() && was_silent) ROS_INFO_STREAM("Simulation time is reserved again");
    lock.lock();
    if (!failure.empty()) wanted_.wait_for(lock, pause_, [this] { return is_over_; });
  }
}

std::uint64_t TimeReservation::next_end() const {
  const std::chrono::duration<double> elapsed = Clock::now() - paced_at_;
  const double used = static_cast<double>(used_ - paced_from_) / kPerSecond;
  const double pace = used / std::max(elapsed.count(), 1e-3);
  const bool is_silent = !failure_.empty();
  const double ahead = is_silent ? std::max(pace, 1.0) * kWallSecondsAheadInOutage
                                 : std::max(pace * kWallSecondsAhead, kMinAhead);
  const auto nanoseconds = static_cast<std::uint64_t>(std::min(ahead, kMaxAhead) * kPerSecond);
  const std::uint64_t until = used_ + std::min(nanoseconds, end_ - used_);
  return is_silent ? std::max(until, asked_) : until;
}

/// @return why it failed; empty on success
std::string TimeReservation::attempt(std::uint64_t until) const {
  try {
    write_(until);
  } catch (const std::exception& error) {
    return printable(error.what());
  }
  return "";
}

void TimeReservation::record_success(std::uint64_t from, std::uint64_t until,
                                     Clock::time_point at) {
  reserved_ = until;
  renew_from_ = until == end_ ? end_ : from + (until - from) / 2;
  // After an outage, write once more, a nearer time: the master may still execute the longer
  // reservations that were sent during the outage.
  is_wanted_ = !failure_.empty() || used_ > renew_from_;
  paced_from_ = from;
  paced_at_ = at;
  has_waited_ = false;
  failure_.clear();
  pause_ = std::chrono::milliseconds::zero();
}

}  // namespace walker
