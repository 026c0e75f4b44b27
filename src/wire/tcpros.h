// TCPROS, ROS 1's connection protocol, as services use it.
//
// Numbers are little-endian. Each side sends one header, the client first. A header is a uint32
// length and its fields; a field is a uint32 length and `name=value`, where the name ends at the
// first `=`. The client's header has `service`, `md5sum` (of the service's definition, or `*`) and
// `callerid`; `persistent=1` keeps the connection open for several calls, `probe=1` announces that
// there are none. The server's header has `md5sum` and `type`, or `error` with a message, after
// which the server closes the connection.
//
// A request is a uint32 length and the serialised message. Its answer is one byte, a uint32 length
// and a body: after 1 the serialised response, after 0 an error message. The server closes the
// connection after the first answer unless it is persistent.
//
// A serialised message is its fields, one after the other: numbers little-endian, strings and
// arrays preceded by a uint32 with the number of their elements.
//
// Source: wiki.ros.org/ROS/TCPROS, wiki.ros.org/ROS/Connection%20Header and
// wiki.ros.org/roscpp/Overview/MessagesSerializationAndAdaptingTypes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace walker {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "numbers are copied as they are");

/// Bounds-checked reader of a message's fields, in order. Every method but try_text throws
/// std::runtime_error if the message ends within the field. Memory is allocated only for elements
/// that have arrived.
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

namespace tcpros {

using Bytes = std::vector<std::uint8_t>;
using Fields = std::map<std::string, std::string>;

constexpr std::size_t kLengthBytes = sizeof(std::uint32_t);
constexpr std::size_t kMaxHeaderBytes = 65536;        // the package's have less than 300
constexpr std::size_t kMaxMessageBytes = 1000000000;  // roscpp's limit

constexpr std::uint8_t kResponseFollows = 1;  // an answer's first byte, unless it is an error

inline std::uint32_t load_length(const std::uint8_t* bytes) {
  std::uint32_t length = 0;
  std::memcpy(&length, bytes, kLengthBytes);
  return length;
}

inline void store_length(std::size_t length, std::uint8_t* bytes) {
  const auto narrow = static_cast<std::uint32_t>(length);
  std::memcpy(bytes, &narrow, kLengthBytes);
}

/// Appends a header, preceded by its length.
inline void append_header(const Fields& fields, Bytes& bytes) {
  const std::size_t begin = bytes.size();
  bytes.resize(begin + kLengthBytes);
  for (const auto& [name, value] : fields) {
    bytes.resize(bytes.size() + kLengthBytes);
    store_length(name.size() + 1 + value.size(), &bytes[bytes.size() - kLengthBytes]);
    bytes.insert(bytes.end(), name.begin(), name.end());
    bytes.push_back('=');
    bytes.insert(bytes.end(), value.begin(), value.end());
  }
  store_length(bytes.size() - begin - kLengthBytes, &bytes[begin]);
}

/// Parses a header. Headers of bag records have the same format.
/// @param bytes a header of `size` bytes, without its length
/// @throws std::runtime_error for a field that is too long, not name=value, or a duplicate
inline Fields parse_header(const std::uint8_t* bytes, std::size_t size) {
  const auto fail = [](const std::string& what) {
    throw std::runtime_error("connection header: " + what);
  };
  Fields fields;
  MessageReader header(bytes, size, "connection header");
  while (header.size() > 0) {
    const std::optional<std::string_view> field = header.try_text();
    if (!field) fail("a field is longer than the header");
    const std::size_t equals = field->find('=');
    if (equals == 0 || equals == std::string_view::npos) {
      fail("a field is not of the form name=value");
    }
    const std::string name(field->substr(0, equals));
    if (!fields.emplace(name, field->substr(equals + 1)).second) fail(name + " comes twice");
  }
  return fields;
}

}  // namespace tcpros
}  // namespace walker
