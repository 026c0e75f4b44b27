// Serialization of requests and responses. wire/message_reader.h describes the format.
// Source: the .srv files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "base/limits.h"
#include "base/printable_text.h"
#include "client/service_types.h"
#include "walker_sim/client.h"
#include "walker_sim/parameters.h"
#include "wire/message_reader.h"
#include "wire/tcpros.h"

namespace walker {

class Writer {
 public:
  explicit Writer(tcpros::Bytes& bytes) : bytes_(bytes) {}

  template <typename Number>
  void number(Number value) {
    append(&value, sizeof(value));
  }

  /// @throws std::invalid_argument if the elements exceed a message's maximum size
  template <typename Number>
  void array(const Number* values, std::size_t size) {
    if (size > tcpros::kMaxMessageBytes / sizeof(Number)) {
      throw std::invalid_argument(std::to_string(size) + " values are too many for one request");
    }
    number(static_cast<std::uint32_t>(size));
    append(values, size * sizeof(Number));
  }

  void text(const std::string& value) { array(value.data(), value.size()); }

  /// Appends a serialized message.
  void message(const std::vector<std::uint8_t>& bytes) { append(bytes.data(), bytes.size()); }

 private:
  void append(const void* data, std::size_t size) {
    const auto* const begin = static_cast<const std::uint8_t*>(data);
    bytes_.insert(bytes_.end(), begin, begin + size);
  }

  tcpros::Bytes& bytes_;
};

/// Reads a response's fields. Every method throws std::runtime_error if the response is too short.
class Reader : public MessageReader {
 public:
  Reader(const std::uint8_t* bytes, std::size_t size) : MessageReader(bytes, size, "the answer") {}

  /// Reads fields in order. Reuses the memory of vectors and strings.
  template <typename... Fields>
  void read(Fields&... fields) {
    (take(fields), ...);
  }

  /// @throws std::runtime_error also for more than `max` strings
  void read_texts(std::vector<std::string>& values, std::size_t max) {
    const std::uint32_t size = count(tcpros::kLengthBytes);
    if (size > max) {
      throw std::runtime_error("its answer's array has " + std::to_string(size) +
                               " texts; must have at most " + std::to_string(max));
    }
    values.resize(size);
    for (std::string& value : values) take(value);
  }

 private:
  template <typename Number>
  void take(Number& value) {
    value = number<Number>();
  }

  void take(bool& value) { value = number<std::uint8_t>() != 0; }
  /// Escapes invalid UTF-8, since callers display strings as UTF-8.
  void take(std::string& value) {
    value = text();
    if (!is_utf8(value)) value = to_utf8(value);
  }

  template <typename Number>
  void take(std::vector<Number>& values) {
    read_array(values);
  }

  void take(std::vector<std::string>& values) { read_texts(values, kMaxTexts); }
};

// Each `read` reads a whole answer and checks all lengths and indices against the specification
// that the server sent last, so that callers need no checks. It throws RequestRefused with the
// server's message if the server refused the request, and std::runtime_error naming the field, its
// value and what is allowed if the answer is malformed. The result is then unspecified.

void read(Reader& reader, ServerSpecification& server);

/// Upper bound of a service's answer [bytes], given the server's specification; at most TCPROS's.
std::size_t max_answer_bytes(ServiceIndex service, const ServerSpecification& server);

void read(Reader& reader, const ServerSpecification& server, Transition& transition);
void read(Reader& reader, const ServerSpecification& server, BatchTransition& batch);

/// @param steps requested number of steps
void read(Reader& reader, const ServerSpecification& server, std::uint32_t steps,
          RepeatedStep& repeated);

/// @param rows number of environments to reset
void read(Reader& reader, const ServerSpecification& server, std::size_t rows, BatchReset& reset);

/// Reads an EpisodeRecord.msg without deserializing it.
void read(Reader& reader, const ServerSpecification& server, std::vector<std::uint8_t>& record);

/// Reads a sensor_msgs/Image. If it throws, `image` is unchanged.
/// @param encoding requested encoding: 32FC1, or else rgb8
/// @param camera   requested camera; may have a width and a height
void read(Reader& reader, const std::string& encoding, const Parameters& camera, Image& image);

/// @throws RequestRefused with the server's reason, with invalid UTF-8 escaped
[[noreturn]] void refuse(std::string_view reason);

}  // namespace walker
