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
// Source: wiki.ros.org/ROS/TCPROS and wiki.ros.org/ROS/Connection%20Header.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "wire/message_reader.h"

namespace walker::tcpros {

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
void append_header(const Fields& fields, Bytes& bytes);

/// A field of a header. Headers of bag records have the same format.
struct Field {
  std::string_view name;  ///< empty if the field is not of the form name=value
  std::string_view value;
};

/// Reads the next field of a header, whose length has been read.
/// @return nullopt, without advancing, if the field is longer than the rest of the header
std::optional<Field> take_field(MessageReader& header);

/// @param bytes a header of `size` bytes, without its length
/// @throws std::runtime_error for a field that is too long, not name=value, or a duplicate
Fields parse_header(const std::uint8_t* bytes, std::size_t size);

}  // namespace walker::tcpros
