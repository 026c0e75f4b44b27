// Serialized ROS messages of untrusted peers: fields one after the other, numbers little-endian,
// strings and arrays after a uint32 with the number of their elements.
// Source: wiki.ros.org/roscpp/Overview/MessagesSerializationAndAdaptingTypes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace walker {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "numbers are copied as they are");

/// Takes fields off the front of a message. Every method but try_text throws std::runtime_error if
/// the message ends within the field; memory is allocated only for elements that have arrived.
class MessageReader {
 public:
  /// @param what names the message in errors, e.g. "the request"
  MessageReader(const std::uint8_t* bytes, std::size_t size, const char* what)
      : next_(bytes), end_(bytes + size), what_(what) {}

  /// Returns the number of bytes left.
  std::size_t size() const { return static_cast<std::size_t>(end_ - next_); }

  template <typename Number>
  Number number() {
    Number value{};
    std::memcpy(&value, bytes(sizeof(value)), sizeof(value));
    return value;
  }

  /// Number of elements of an array, each of which has at least `bytes_each` bytes.
  std::uint32_t count(std::size_t bytes_each) {
    const auto value = number<std::uint32_t>();
    if (value > size() / bytes_each) fail(" ends within a field");
    return value;
  }

  /// An array of numbers. The vector keeps its memory.
  template <typename Number>
  void read_array(std::vector<Number>& values) {
    values.resize(count(sizeof(Number)));
    const std::size_t size = values.size() * sizeof(Number);
    if (size > 0) std::memcpy(values.data(), bytes(size), size);
  }

  /// A view of a string's bytes, or of a uint8[]'s, which has the same form.
  std::string_view text() {
    const std::optional<std::string_view> text = try_text();
    if (!text) fail(" ends within a field");
    return *text;
  }

  /// @return nothing, and takes nothing, if the message ends within the string
  std::optional<std::string_view> try_text() {
    std::uint32_t length = 0;
    if (size() < sizeof(length)) return std::nullopt;
    std::memcpy(&length, next_, sizeof(length));
    if (length > size() - sizeof(length)) return std::nullopt;
    bytes(sizeof(length));
    return std::string_view(reinterpret_cast<const char*>(bytes(length)), length);
  }

  /// Takes as many bytes.
  const std::uint8_t* bytes(std::size_t size) {
    if (size > this->size()) fail(" ends within a field");
    const std::uint8_t* const begin = next_;
    next_ += size;
    return begin;
  }

  /// @throws std::runtime_error if bytes are left
  void finish() const {
    if (next_ != end_) fail(" is longer than its type");
  }

 private:
  [[noreturn]] void fail(const char* why) const {
    throw std::runtime_error(std::string(what_) + why);
  }

  const std::uint8_t* next_;
  const std::uint8_t* end_;
  const char* what_;
};

}  // namespace walker
