// Requests and responses as bytes, of the form that message_reader.h describes.
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

/// Appends fields to a request.
class Writer {
 public:
  explicit Writer(tcpros::Bytes& bytes) : bytes_(bytes) {}

  template <typename Number>
  void number(Number value) {
    append(&value, sizeof(value));
  }

  /// @throws std::invalid_argument for more elements than a message can have
  template <typename Number>
  void array(const Number* values, std::size_t size) {
    if (size > tcpros::kMaxMessageBytes / sizeof(Number)) {
      throw std::invalid_argument(std::to_string(size) + " values are too many for one request");
    }
    number(static_cast<std::uint32_t>(size));
    append(values, size * sizeof(Number));
  }

  void text(const std::string& value) { array(value.data(), value.size()); }

  /// A message whose bytes are at hand.
  void message(const std::vector<std::uint8_t>& bytes) { append(bytes.data(), bytes.size()); }

 private:
  void append(const void* data, std::size_t size) {
    const auto* const begin = static_cast<const std::uint8_t*>(data);
    bytes_.insert(bytes_.end(), begin, begin + size);
  }

  tcpros::Bytes& bytes_;
};

/// Takes fields off a response. Every method throws std::runtime_error where it is too short.
class Reader : public MessageReader {
 public:
  Reader(const std::uint8_t* bytes, std::size_t size) : MessageReader(bytes, size, "the answer") {}

  /// One field after the other. Vectors and texts keep their memory.
  template <typename... Fields>
  void read(Fields&... fields) {
    (take(fields), ...);
  }

  /// An array of at most `max` texts.
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
  /// Bytes that are no UTF-8 are escaped, for who shows a text takes it for UTF-8.
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

// Each of these reads an answer. Whatever it says is checked, all lengths and indices, so that who
// uses a result needs no check of its own. They throw RequestRefused with the server's words where
// it did not do what it was asked to, and std::runtime_error that names the field, its value and
// what is allowed; then the result is of no meaning. Answers are measured by what the server has
// last told of itself.

void read(Reader& reader, ServerSpecification& told);

/// How long an answer of a server that has told this of itself can be: of a known service, below
/// what TCPROS allows in any case.
std::size_t most_answer_bytes(ServiceIndex service, const ServerSpecification& server);

void read(Reader& reader, const ServerSpecification& server, Transition& transition);
void read(Reader& reader, const ServerSpecification& server, BatchTransition& batch);

/// @param steps that were to be made
void read(Reader& reader, const ServerSpecification& server, std::uint32_t steps,
          RepeatedStep& repeated);

/// @param rows environments that were to be reset
void read(Reader& reader, const ServerSpecification& server, std::size_t rows, BatchReset& reset);

/// EpisodeRecord.msg, whose bytes are kept as they are.
void read_record(Reader& reader, std::vector<std::uint8_t>& record);

/// sensor_msgs/Image; where it throws, the image is as it was.
/// @param encoding that was asked for: 32FC1, or else rgb8
/// @param camera   that was asked for; may have a width and a height
void read(Reader& reader, const std::string& encoding, const Parameters& camera, Image& image);

/// Of an answer by which the server refuses. @throws RequestRefused with its words, made UTF-8
[[noreturn]] void refuse(std::string_view reason);

}  // namespace walker
