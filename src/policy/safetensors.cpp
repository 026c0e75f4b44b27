#include "policy/safetensors.h"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string_view>

#include "policy/json.h"

namespace walker {
namespace {

constexpr std::size_t kMaxHeader = std::size_t{1} << 20U;
constexpr std::size_t kMaxValues = std::size_t{1} << 26U;

/// All supported machines are little-endian, as the file is.
template <typename Number>
Number read_as(const char* bytes) {
  Number value;
  std::memcpy(&value, bytes, sizeof(value));
  return value;
}

template <typename Number>
void append_values(const char* bytes, std::size_t count, std::vector<double>& values) {
  for (std::size_t i = 0; i < count; ++i) {
    values.push_back(double{read_as<Number>(bytes + i * sizeof(Number))});
  }
}

/// @param left bytes of the file that the other tensors have left; reduced by this one's. Without
///             this limit, many overlapping tensors of a small file could exhaust the memory
Tensor read_tensor(const std::string& name, const json::Object& entry, const char* begin,
                   std::size_t size, std::size_t& left) {
  const auto field = [&](const char* key) -> const json::Value& {
    const auto found = entry.find(key);
    if (found == entry.end()) throw std::invalid_argument(name + " has no " + key);
    return found->second;
  };
  Tensor tensor;
  std::size_t count = 1;
  for (const json::Value& extent : field("shape").array(name + "'s shape")) {
    const std::uint64_t value = extent.whole(name + "'s extent");
    if (value == 0 || value > kMaxValues / count) {
      throw std::invalid_argument(name + " has an extent of " + std::to_string(value));
    }
    tensor.shape.push_back(value);
    count *= value;
  }
  const std::string& type = field("dtype").text(name + "'s dtype");
  if (type != "F32" && type != "F64") {
    throw std::invalid_argument(name + " is of type " + type + "; must be F32 or F64");
  }
  const std::size_t width = type == "F32" ? sizeof(float) : sizeof(double);
  const json::Array& offsets = field("data_offsets").array(name + "'s data_offsets");
  if (offsets.size() != 2) throw std::invalid_argument(name + " has not two data_offsets");
  const std::uint64_t from = offsets[0].whole(name + "'s begin");
  const std::uint64_t to = offsets[1].whole(name + "'s end");
  if (from > to || to > size) {
    throw std::invalid_argument(name + " ends at byte " + std::to_string(to) + " of " +
                                std::to_string(size));
  }
  if (to - from != count * width) {
    throw std::invalid_argument(name + " has " + std::to_string(to - from) + " bytes; its shape " +
                                "needs " + std::to_string(count * width));
  }
  if (to - from > left) {
    throw std::invalid_argument(name + " has " + std::to_string(to - from) + " bytes; of all " +
                                std::to_string(size) + " the other tensors leave " +
                                std::to_string(left));
  }
  left -= to - from;
  tensor.values.reserve(count);
  if (type == "F32") {
    append_values<float>(begin + from, count, tensor.values);
  } else {
    append_values<double>(begin + from, count, tensor.values);
  }
  for (const double value : tensor.values) {
    if (!std::isfinite(value)) {
      throw std::invalid_argument(name + " has a value that is not finite");
    }
  }
  return tensor;
}

}  // namespace

Tensors read_safetensors(const std::vector<char>& data) {
  std::uint64_t header_size = 0;
  if (data.size() < sizeof(header_size)) {
    throw std::invalid_argument("it has " + std::to_string(data.size()) + " bytes");
  }
  header_size = read_as<std::uint64_t>(data.data());
  const std::size_t rest = data.size() - sizeof(header_size);
  if (header_size > rest || header_size > kMaxHeader) {
    throw std::invalid_argument("its header should have " + std::to_string(header_size) +
                                " bytes; the file has " + std::to_string(data.size()));
  }
  const char* const header = data.data() + sizeof(header_size);
  const char* const values = header + header_size;
  const json::Value root = json::parse(std::string_view(header, header_size));
  std::size_t left = rest - header_size;
  Tensors tensors;
  for (const auto& [name, value] : root.object("its header")) {
    const json::Object& entry = value.object(name);
    if (name == "__metadata__") {
      for (const auto& [key, text] : entry) tensors.metadata[key] = text.text(key);
    } else {
      tensors.by_name[name] = read_tensor(name, entry, values, rest - header_size, left);
    }
  }
  return tensors;
}

}  // namespace walker
