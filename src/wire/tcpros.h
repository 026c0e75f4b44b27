// TCPROS, the protocol of ROS 1's connections, as far as services use it.
//
// Numbers are little-endian. A connection begins with one header from each side, the client's
// first. A header is a uint32, the number of bytes that follow, and then its fields: a uint32 and
// as many bytes `name=value`, the name ending at the first `=`. A client's header has `service`,
// `md5sum` (of the service's definition, or `*`) and `callerid`; `persistent=1` keeps the
// connection for more than one call, `probe=1` says that none will come. The server's has `md5sum`
// and `type`, or `error` with a text, after which it closes the connection.
// Then each call is a request, uint32 length and the serialised message, answered by one byte and a
// length and as many bytes: after 1 the serialised response, after 0 a text that says why there is
// none. The server closes the connection after the first answer unless it is to persist.
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
constexpr std::size_t kMaxHeaderBytes = 65536;        // ours have less than 300
constexpr std::size_t kMaxMessageBytes = 1000000000;  // as roscpp draws the line

constexpr std::uint8_t kResponseFollows = 1;  // first byte of an answer that is no text

inline std::uint32_t load_length(const std::uint8_t* bytes) {
  std::uint32_t length = 0;
  std::memcpy(&length, bytes, kLengthBytes);
  return length;
}

inline void store_length(std::size_t length, std::uint8_t* bytes) {
  const auto narrow = static_cast<std::uint32_t>(length);
  std::memcpy(bytes, &narrow, kLengthBytes);
}

/// Appends a header with its length.
void append_header(const Fields& fields, Bytes& bytes);

/// A field of a header. Records of bags have such headers, too.
struct Field {
  std::string_view name;  ///< empty if the field is not of the form name=value
  std::string_view value;
};

/// Takes a field off the front of a header, whose own length is not part of it.
/// @return nothing, and takes nothing, if the field is longer than the header
std::optional<Field> take_field(MessageReader& header);

/// @param bytes a header without its length, `size` bytes
/// @throws std::runtime_error saying what is wrong with it
Fields parse_header(const std::uint8_t* bytes, std::size_t size);

}  // namespace walker::tcpros
