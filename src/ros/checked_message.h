// Bounds-checked messages from untrusted peers: deserialization and subscriptions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include <ros/console.h>
#include <ros/message_event.h>
#include <ros/message_traits.h>
#include <ros/node_handle.h>
#include <ros/serialization.h>
#include <ros/subscriber.h>
#include <ros/transport_hints.h>
#include <boost/shared_ptr.hpp>

#include "base/limits.h"
#include "base/printable_text.h"
#include "ros/throttle.h"
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
                               " are accepted");
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

/// A received message and the outcome of its deserialization. To roscpp it is a `Message`, but its
/// arrays are allocated only for elements that have arrived; roscpp allocates the announced size.
template <typename Message>
struct CheckedMessage {
  Message message;
  std::string error;  ///< empty if `message` is valid, else the reason
};

/// Far above the messages of all topics to which this package subscribes.
constexpr std::size_t kMaxMessageBytes = 1 << 20;

/// @param take   called with each valid message and its publisher's name, escaped and truncated
/// @param refuse called with the reason for each malformed message
template <typename Message>
ros::Subscriber subscribe_checked(
    ros::NodeHandle& node, const std::string& topic, std::uint32_t queue,
    const std::function<void(const boost::shared_ptr<const Message>&, const std::string&)>& take,
    const std::function<void(const std::string&)>& refuse,
    const ros::TransportHints& hints = ros::TransportHints()) {
  using Checked = CheckedMessage<Message>;
  using Event = const ros::MessageEvent<const Checked>&;
  // boost::function owns the lambda. NOLINTNEXTLINE(clang-analyzer-cplusplus.NewDeleteLeaks)
  const boost::function<void(Event)> callback = [take, refuse](Event event) {
    const boost::shared_ptr<const Checked>& checked = event.getConstMessage();
    if (checked->error.empty()) {
      take(boost::shared_ptr<const Message>(checked, &checked->message),
           printable(event.getPublisherName(), kMaxQuotedBytes));
    } else {
      refuse(checked->error);
    }
  };
  return node.subscribe<Checked, Event>(topic, queue, callback, ros::VoidConstPtr(), hints);
}

/// Overload that logs malformed messages with their count, at most once per second.
template <typename Message>
ros::Subscriber subscribe_checked(
    ros::NodeHandle& node, const std::string& topic, std::uint32_t queue,
    const std::function<void(const boost::shared_ptr<const Message>&)>& take,
    const ros::TransportHints& hints = ros::TransportHints()) {
  const auto refuse = [topic, throttle = Throttle(),
                       refused = std::uint64_t{0}](const std::string& reason) mutable {
    ++refused;
    if (!throttle.passes()) return;
    ROS_ERROR_STREAM("Refused " << topic << ": " << reason << " (" << refused << " so far)");
  };
  return subscribe_checked<Message>(
      node, topic, queue, [take](const auto& message, const auto&) { take(message); }, refuse,
      hints);
}

}  // namespace walker

namespace ros {
namespace message_traits {

template <typename Message>
struct IsMessage<walker::CheckedMessage<Message>> : TrueType {};

template <typename Message>
struct MD5Sum<walker::CheckedMessage<Message>> : MD5Sum<Message> {};

template <typename Message>
struct DataType<walker::CheckedMessage<Message>> : DataType<Message> {};

template <typename Message>
struct Definition<walker::CheckedMessage<Message>> : Definition<Message> {};

}  // namespace message_traits

namespace serialization {

template <typename Message>
struct Serializer<walker::CheckedMessage<Message>> {
  /// Consumes the whole stream, even if the message is malformed.
  template <typename Stream>
  static void read(Stream& stream, walker::CheckedMessage<Message>& checked) {
    const std::uint32_t size = stream.getLength();
    const std::uint8_t* const bytes = stream.advance(size);
    if (size > walker::kMaxMessageBytes) {
      checked.error = "the message has " + std::to_string(size) + " bytes; must have at most " +
                      std::to_string(walker::kMaxMessageBytes);
      return;
    }
    try {
      walker::read_exactly(bytes, size, "the message", checked.message);
    } catch (const std::exception& error) {
      checked.error = error.what();
    }
  }
};

}  // namespace serialization
}  // namespace ros
