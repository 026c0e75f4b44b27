// Requests as roscpp's generated code reads them, from peers that are not to be trusted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <ros/serialization.h>

namespace walker {

/// In place of ros::serialization::IStream, which makes room for as many elements as an array
/// claims to have before it looks whether they have come.
class RequestStream : public ros::serialization::Stream {
 public:
  RequestStream(const std::uint8_t* bytes, std::size_t size)
      : Stream(const_cast<std::uint8_t*>(bytes),  // NOLINT: it is only read
               static_cast<std::uint32_t>(size)) {}

  template <typename Field>
  void next(Field& field) {
    ros::serialization::deserialize(*this, field);
  }

  template <typename Element, typename Allocator>
  void next(std::vector<Element, Allocator>& field) {
    std::uint32_t count = 0;
    RequestStream(getData(), getLength()).next(count);
    constexpr bool is_simple = ros::message_traits::IsSimple<Element>::value;
    constexpr std::size_t kLeastBytes = is_simple ? sizeof(Element) : sizeof(count);
    if (count > getLength() / kLeastBytes) ros::serialization::throwStreamOverrun();
    ros::serialization::deserialize(*this, field);
  }
};

}  // namespace walker
