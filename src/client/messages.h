// Requests and responses as bytes: fields one after the other, numbers little-endian, strings and
// arrays after a uint32 with the number of their elements.
// Source: wiki.ros.org/roscpp/Overview/MessagesSerializationAndAdaptingTypes, and the .srv files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "client/tcpros.h"
#include "walker_sim/client.h"

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

/// Takes fields off a response. Every method throws std::runtime_error where it is too short.
class Reader {
 public:
  Reader(const std::uint8_t* bytes, std::size_t size) : next_(bytes), end_(bytes + size) {}

  template <typename Number>
  void number(Number& value) {
    std::memcpy(&value, take(1, sizeof(Number)), sizeof(Number));
  }

  void flag(bool& value) { value = *take(1, 1) != 0; }

  void text(std::string& value) {
    const std::size_t size = length();
    const std::uint8_t* const begin = take(size, 1);
    value.assign(begin, begin + size);
  }

  void skip_text() {
    const std::size_t size = length();
    take(size, 1);
  }

  template <typename Number>
  void array(std::vector<Number>& values) {
    const std::size_t size = length();
    const std::uint8_t* const begin = take(size, sizeof(Number));
    values.resize(size);
    if (size > 0) std::memcpy(values.data(), begin, size * sizeof(Number));
  }

  void array(std::vector<std::string>& values) {
    const std::size_t size = length();
    require(size, tcpros::kLengthBytes);  // before memory for it is asked for
    values.resize(size);
    for (std::string& value : values) text(value);
  }

  /// Numbers whose bytes are a uint8[].
  /// @param bytes that it must have, a multiple of the number's
  template <typename Number>
  void packed(std::size_t bytes, std::vector<Number>& values) {
    const std::size_t size = length();
    if (size != bytes) {
      throw std::runtime_error(std::to_string(size) + " bytes of data came instead of " +
                               std::to_string(bytes));
    }
    const std::uint8_t* const begin = take(size, 1);
    values.resize(size / sizeof(Number));
    if (size > 0) std::memcpy(values.data(), begin, size);
  }

  /// @throws std::runtime_error where something is left
  void finish() const {
    if (next_ != end_) throw std::runtime_error("the answer is longer than its type");
  }

 private:
  std::size_t length() {
    std::uint32_t size = 0;
    number(size);
    return size;
  }

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

void read(Reader& reader, Transition& transition);
void read(Reader& reader, BatchReset& reset);
void read(Reader& reader, BatchTransition& transition);
void read(Reader& reader, ServerSpecification& specification);

/// sensor_msgs/Image.
/// @param encoding that was asked for: 32FC1, or else rgb8
void read(Reader& reader, const std::string& encoding, Image& image);

}  // namespace walker
