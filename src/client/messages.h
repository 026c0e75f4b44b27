// Requests and responses as bytes: fields one after the other, numbers little-endian, strings and
// arrays after a uint32 with the number of their elements.
// Source: wiki.ros.org/roscpp/Overview/MessagesSerializationAndAdaptingTypes, and the .srv files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "client/tcpros.h"
#include "walker_sim/client.h"
#include "walker_sim/parameters.h"

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
    if (size > tcpros::kMostMessageBytes / sizeof(Number)) {
      throw std::invalid_argument(std::to_string(size) + " values are too many for one request");
    }
    number(static_cast<std::uint32_t>(size));
    append(values, size * sizeof(Number));
  }

  void text(const std::string& value) { array(value.data(), value.size()); }

  /// @throws as `array`
  void texts(const std::vector<std::string>& values) {
    number(static_cast<std::uint32_t>(values.size()));
    for (const std::string& value : values) text(value);
  }

 private:
  void append(const void* data, std::size_t size) {
    const auto* const begin = static_cast<const std::uint8_t*>(data);
    bytes_.insert(bytes_.end(), begin, begin + size);
  }

  tcpros::Bytes& bytes_;
};

/// An array of numbers that still lies in the answer's bytes.
template <typename Number>
class Numbers {
 public:
  Numbers(const std::uint8_t* bytes, std::size_t size) : bytes_(bytes), size_(size) {}

  std::size_t size() const { return size_; }

  Number operator[](std::size_t index) const {
    Number number;
    std::memcpy(&number, bytes_ + index * sizeof(Number), sizeof(Number));
    return number;
  }

  void copy_to(std::vector<Number>& values) const {
    values.resize(size_);
    if (size_ > 0) std::memcpy(values.data(), bytes_, size_ * sizeof(Number));
  }

 private:
  const std::uint8_t* bytes_;
  std::size_t size_;
};

/// Takes fields off a response. Every method throws std::runtime_error where it is too short.
class Reader {
 public:
  Reader(const std::uint8_t* bytes, std::size_t size) : next_(bytes), end_(bytes + size) {}

  template <typename Number>
  Number number() {
    return Numbers<Number>(take(1, sizeof(Number)), 1)[0];
  }

  bool flag() { return *take(1, 1) != 0; }

  /// Of the answer's bytes.
  std::string_view text() {
    const std::size_t size = number<std::uint32_t>();
    return {reinterpret_cast<const char*>(take(size, 1)), size};
  }

  template <typename Number>
  Numbers<Number> array() {
    const std::size_t size = number<std::uint32_t>();
    return {take(size, sizeof(Number)), size};
  }

  std::vector<std::string> texts() {
    const std::size_t size = number<std::uint32_t>();
    require(size, tcpros::kLengthBytes);  // before memory for it is asked for
    std::vector<std::string> values(size);
    for (std::string& value : values) value = text();
    return values;
  }

  /// @throws std::runtime_error where something is left
  void finish() const {
    if (next_ != end_) throw std::runtime_error("the answer is longer than its type");
  }

 private:
  void require(std::size_t count, std::size_t bytes_each) const {
    if (count <= static_cast<std::size_t>(end_ - next_) / bytes_each) return;
    throw std::runtime_error("the answer ends within a field");
  }

  const std::uint8_t* take(std::size_t count, std::size_t bytes_each) {
    require(count, bytes_each);
    const std::uint8_t* const begin = next_;
    next_ += count * bytes_each;
    return begin;
  }

  const std::uint8_t* next_;
  const std::uint8_t* end_;
};

/// What a server's answers are measured by.
struct AnswerSizes {
  AnswerSizes() = default;
  explicit AnswerSizes(const ServerSpecification& specification);

  std::size_t num_envs = 0;
  std::size_t observation = 0;
  std::size_t action = 0;
  std::size_t info = 0;
};

// Each of these reads the rest of an answer. Whatever it says is checked first: all lengths and
// indices, so that who uses a result needs no check of its own. They throw std::runtime_error that
// names the field, its value and what is allowed; then the result is as it was.

void read(Reader& reader, ServerSpecification& specification);
void read(Reader& reader, const AnswerSizes& sizes, Transition& transition);
void read(Reader& reader, const AnswerSizes& sizes, BatchTransition& transition);

/// @param rows environments that were to be reset
void read(Reader& reader, const AnswerSizes& sizes, std::size_t rows, BatchReset& reset);

/// sensor_msgs/Image.
/// @param encoding that was asked for: 32FC1, or else rgb8
/// @param camera   that was asked for; may have a width and a height
void read(Reader& reader, const std::string& encoding, const Parameters& camera, Image& image);

}  // namespace walker
