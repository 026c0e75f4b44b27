// The services that the client calls, and the serialization of their requests and responses.
// Source: the .srv files.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "base/limits.h"
#include "base/printable_text.h"
#include "walker_sim/client.h"
#include "walker_sim/parameters.h"
#include "wire/tcpros.h"

namespace walker {

struct ServiceType {
  const char* name;  ///< relative to the server's
  const char* type;
  const char* md5sum;  ///< of the definition in srv/; service_types_test compares it with ROS's
};

enum ServiceIndex : std::size_t {
  kGetSpec,
  kReset,
  kStep,
  kResetBatch,
  kStepBatch,
  kRender,
  kStepMany,
  kSnapshot,
  kRestore,
  kSetWorld,
  kSetState
};

// Bounds get_spec's answer, which no specification can. Enough for 500000 observation values.
constexpr std::size_t kMaxSpecificationBytes = 1 << 24;

constexpr std::array<ServiceType, 11> kServiceTypes{{
    {"get_spec", "walker_sim/GetSpec", "abfc13e4553f7a78d84fce4dbffa7b4a"},
    {"reset", "walker_sim/Reset", "579fbd4452dd839cc753a5aa78a35ac6"},
    {"step", "walker_sim/Step", "966a6fb1bec39160c190f0f4547374a0"},
    {"reset_batch", "walker_sim/ResetBatch", "437ef1d1c361663ae281e556ca29d233"},
    {"step_batch", "walker_sim/StepBatch", "098e99818551b9955c1d046d341ea5de"},
    {"render", "walker_sim/Render", "ddec8823bcc866f5390ff2c9bb477f29"},
    {"step_many", "walker_sim/StepMany", "0f84f7c61cb488b9aad4529423766e03"},
    {"snapshot", "walker_sim/Snapshot", "7c84163974c04a7a61f10013de6e4f9e"},
    {"restore", "walker_sim/Restore", "9d793d292ae21f16fad555da701d5688"},
    {"set_world", "walker_sim/SetWorld", "d74d5d34e872d10873dd549440f00e82"},
    {"set_state", "walker_sim/SetState", "3e735194762c04fdaa86e427d37576e4"},
}};

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

/// Writes a World.msg. @param world empty: Gymnasium's; nullopt: the server's own
void write(Writer& writer, const std::optional<World>& world);
void write(Writer& writer, const std::vector<World>& worlds);

// Each `read` reads a whole answer and checks all lengths and indices against the specification
// that the server sent last, so that callers need no checks. It throws RequestRefused with the
// server's message if the server refused the request, and std::runtime_error naming the field, its
// value and what is allowed if the answer is malformed. The result is then unspecified.

void read(Reader& reader, ServerSpecification& server);

/// Reads an answer that has only `success` and `status_message`.
void read(Reader& reader);

/// Upper bound of a service's answer [bytes], given the server's specification; at most TCPROS's.
std::size_t max_answer_bytes(ServiceIndex service, const ServerSpecification& server);

void read(Reader& reader, const ServerSpecification& server, Transition& transition);
void read(Reader& reader, const ServerSpecification& server, Reset& reset);
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
