// Bounds-checked reader of serialized ROS messages: consecutive fields, numbers little-endian,
// strings and arrays preceded by a uint32 with the number of their elements.
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

/// Reads a message's fields in order. Every method but try_text throws std::runtime_error if the
/// message ends within the field. Memory is allocated only for elements that have arrived.
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

  /// Reads the number of elements of an array whose elements have at least `bytes_each` bytes.
  std::uint32_t count(std::size_t bytes_each) {
    const auto value = number<std::uint32_t>();
    if (value > size() / bytes_each) fail(" ends within a field");
    return value;
  }

  /// Reads an array of numbers. Reuses the vector's memory.
  template <typename Number>
  void read_array(std::vector<Number>& values) {
    values.resize(count(sizeof(Number)));
    const std::size_t size = values.size() * sizeof(Number);
    if (size > 0) std::memcpy(values.data(), bytes(size), size);
  }

  /// Returns a view of a string or a uint8[], which have the same format.
  std::string_view text() {
    const std::optional<std::string_view> text = try_text();
    if (!text) fail(" ends within a field");
    return *text;
  }

  /// Returns nullopt, and does not advance, if the message ends within the string.
  std::optional<std::string_view> try_text() {
    std::uint32_t length = 0;
    if (size() < sizeof(length)) return std::nullopt;
    std::memcpy(&length, next_, sizeof(length));
    if (length > size() - sizeof(length)) return std::nullopt;
    bytes(sizeof(length));
    return std::string_view(reinterpret_cast<const char*>(bytes(length)), length);
  }

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
