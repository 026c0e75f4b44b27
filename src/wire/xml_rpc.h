// XML-RPC's texts: a call with strings, and whatever comes as an answer.
// Source: xmlrpc.com/spec.md, and wiki.ros.org/ROS/Master_API for what masters say with it.
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
  std::string text;             ///< of a value that is not made of others
  std::int64_t integer = 0;     ///< of an integer
  std::vector<Value> elements;  ///< of an array, or of a structure in the order of its members
};

/// The peer says that the call itself went wrong; the message is its own.
struct Fault : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// @param arguments become strings
std::string make_call(const std::string& method, const std::vector<std::string>& arguments);

/// @return the answer's one value
/// @throws Fault; std::runtime_error saying at which byte the text is not an answer
Value parse_answer(const std::string& xml);

}  // namespace walker::xml_rpc
