#include "episode/state_header.h"

#include <array>
#include <map>
#include <utility>

#include "base/engine_release.h"
#include "episode/episode_record.h"

namespace walker {
namespace {

constexpr std::array<char, 8> kMagic{'W', 'A', 'L', 'K', 'E', 'R', 'S', 'T'};

/// Offsets in the header. Size and checksum cover the bytes from kBodyAt on.
constexpr std::size_t kSizeAt = kMagic.size() + sizeof(kStateFormat);
constexpr std::size_t kChecksumAt = kSizeAt + sizeof(std::uint64_t);
constexpr std::size_t kBodyAt = kChecksumAt + sizeof(std::uint64_t);

using Fields = std::vector<std::pair<std::string, std::string>>;

Fields fields_of(const Specification& specification) {
  Fields fields{{"id", specification.id},
                {"engine", specification.engine},
                {"engine_version", engine_release(specification.engine_version)}};
  for (const auto& [name, value] : describe_origin(specification).parameters) {
    if (name != "max_episode_steps") fields.emplace_back("parameter " + name, value);
  }
  return fields;
}

Fields read_fields(StateReader& reader) {
  constexpr std::size_t kMinBytes = 2 * sizeof(std::uint32_t);
  Fields fields(reader.count(kMinBytes));
  for (auto& [name, value] : fields) {
    name = reader.text();
    value = reader.text();
  }
  return fields;
}

[[noreturn]] void refuse(const std::string& name, const std::string& there,
                         const std::string& here) {
  throw std::invalid_argument("the state is of another environment: " + name + " = " + there +
                              " there; here it is " + here);
}

}  // namespace

StateOrigin::StateOrigin(const Specification& specification) {
  StateWriter writer(text_);
  const Fields fields = fields_of(specification);
  writer.number(static_cast<std::uint32_t>(fields.size()));
  for (const auto& [name, value] : fields) {
    writer.text(name);
    writer.text(value);
  }
}

std::size_t StateOrigin::begin(std::vector<std::byte>& state) const {
  const std::size_t begin = state.size();
  StateWriter writer(state);
  writer.numbers(kMagic.data(), kMagic.size());
  writer.number(kStateFormat);
  writer.number(std::uint64_t{0});  // `seal` fills in size and checksum
  writer.number(std::uint64_t{0});
  writer.numbers(text_.data(), text_.size());
  return begin;
}

void StateOrigin::seal(std::vector<std::byte>& state, std::size_t begin) {
  std::byte* const header = state.data() + begin;
  const std::uint64_t size = state.size() - begin - kBodyAt;
  const std::uint64_t sum = checksum(header + kBodyAt, size);
  std::memcpy(header + kSizeAt, &size, sizeof size);
  std::memcpy(header + kChecksumAt, &sum, sizeof sum);
}

StateReader StateOrigin::open(const std::byte* state, std::size_t size) const {
  if (size < kMagic.size() || std::memcmp(state, kMagic.data(), kMagic.size()) != 0) {
    throw std::invalid_argument("these " + std::to_string(size) +
                                " bytes are no saved state; one begins with " +
                                std::string(kMagic.data(), kMagic.size()));
  }
  StateReader reader(state + kMagic.size(), size - kMagic.size());
  const auto format = reader.number<std::uint32_t>();
  if (format != kStateFormat) {
    throw std::invalid_argument("the state has format version " + std::to_string(format) +
                                "; must be " + std::to_string(kStateFormat));
  }
  const auto body_size = reader.number<std::uint64_t>();
  const auto sum = reader.number<std::uint64_t>();
  if (body_size != reader.size()) {
    refuse_state("after its header it has " + std::to_string(reader.size()) + " bytes; must have " +
                 std::to_string(body_size));
  }
  if (sum != checksum(reader.next(), reader.size())) {
    refuse_state("its checksum does not match");
  }
  if (reader.size() < text_.size() || std::memcmp(reader.next(), text_.data(), text_.size()) != 0) {
    throw_difference(reader);
  }
  return {reader.next() + text_.size(), reader.size() - text_.size()};
}

/// Throws the error for the first difference, in the order of this environment's fields.
void StateOrigin::throw_difference(StateReader reader) const {
  const std::string absent = "(absent)";
  StateReader own_reader(text_.data(), text_.size());
  const Fields own = read_fields(own_reader);
  std::map<std::string, std::string> there;
  for (auto& [name, value] : read_fields(reader)) there[name] = value;
  for (const auto& [name, value] : own) {
    const auto found = there.find(name);
    if (found == there.end()) refuse(name, absent, value);
    if (found->second != value) refuse(name, found->second, value);
    there.erase(found);
  }
  for (const auto& [name, value] : there) refuse(name, value, absent);
  refuse_state("it names its origin in another order");
}

}  // namespace walker
