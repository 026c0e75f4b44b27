// Bounds-checked deserialization of ROS messages from untrusted peers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include <ros/serialization.h>

#include "base/limits.h"
#include "wire/tcpros.h"

namespace walker {

/// Replaces ros::serialization::IStream, which allocates an array's announced size before it checks
/// that the elements have arrived.
class CheckedStream : public MessageReader {
 public:
  using MessageReader::MessageReader;

  std::uint8_t* advance(std::size_t size) {
    return const_cast<std::uint8_t*>(bytes(size));  // NOLINT: it is only read
  }

  template <typename Field>
  void next(Field& field) {
    ros::serialization::deserialize(*this, field);
  }

  template <typename Element, typename Allocator>
  void next(std::vector<Element, Allocator>& field) {
    constexpr bool is_simple = ros::message_traits::IsSimple<Element>::value;
    constexpr std::size_t kMinBytes = is_simple ? sizeof(Element) : sizeof(std::uint32_t);
    const std::uint32_t count = MessageReader(*this).count(kMinBytes);
    // An empty string takes 4 bytes in the stream and eight times as many in memory.
    constexpr bool is_text = std::is_same_v<Element, std::string>;
    constexpr std::uint32_t kMax = is_text ? kMaxTexts : kMaxEnvironments;
    if (!is_simple && count > kMax) {
      throw std::runtime_error("an array has " + std::to_string(count) + " elements; at most " +
                               std::to_string(kMax) + (is_text ? " texts" : " messages") +
                               " are taken");
    }
    ros::serialization::deserialize(*this, field);
  }
};

/// Deserializes a message that fills `bytes` exactly.
/// @param what names the bytes in errors, e.g. "the request"
/// @throws std::runtime_error if bytes are missing or left over, or an array has too many strings
template <typename Message>
void read_exactly(const std::uint8_t* bytes, std::size_t size, const std::string& what,
                  Message& message) {
  CheckedStream stream(bytes, size, what.c_str());
  stream.next(message);
  stream.finish();
}

}  // namespace walker
