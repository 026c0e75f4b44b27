// XML-RPC encoding of calls with string arguments, and decoding of their answers.
// Source: xmlrpc.com/spec.md, and wiki.ros.org/ROS/Master_API for the masters' values.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace walker::xml_rpc {

/// A value of any of the types that ROS masters and nodes use.
struct Value {
  enum class Kind { integer, boolean, floating, text, array, structure };

  Kind kind = Kind::text;
  std::string text;             ///< content of a scalar
  std::int64_t integer = 0;     ///< value, if `kind` is integer
  std::vector<Value> elements;  ///< of an array, or a structure's members in order
};

/// The peer answered with an XML-RPC fault; the message is the peer's.
struct Fault : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// @param value last argument, as XML; empty: none
std::string make_call(const std::string& method, const std::vector<std::string>& arguments,
                      const std::string& value = "");

/// @throws Fault; std::runtime_error with the offset of the first malformed byte
Value parse_answer(const std::string& xml);

}  // namespace walker::xml_rpc
