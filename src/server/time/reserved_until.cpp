#include "server/time/reserved_until.h"

#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include "base/parameter_text.h"

namespace walker {
namespace {

using xml_rpc::Value;

constexpr std::uint64_t kPerSecond = 1'000'000'000;
constexpr double kLastSecond = 4294967295.0;  // 2^32 - 1, where ROS time ends
constexpr double kLastNanosecond = 999999999.0;

/// The value if it is an integer in [0, last]; else none.
std::optional<std::uint64_t> to_integer(const Value& value, double last) {
  std::optional<double> number;
  if (value.kind == Value::Kind::integer) number = static_cast<double>(value.integer);
  // YAML 1.1 reads 1.0e3 as a string.
  if (value.kind == Value::Kind::floating || value.kind == Value::Kind::text) {
    number = parse_number(value.text);
  }
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

}  // namespace walker
