// Policy files, written byte by byte.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace walker {

template <typename Number>
void append(Number value, std::string& bytes) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

/// Content of a file with this header.
inline std::string with_size(const std::string& header) {
  std::string bytes;
  append(std::uint64_t{header.size()}, bytes);
  return bytes + header;
}

struct Written {
  std::string dtype;  // F32 or F64
  std::vector<std::size_t> shape;
  std::vector<double> values;
};

/// A policy file, written byte by byte.
struct PolicyBytes {
  std::map<std::string, std::string> metadata;
  std::map<std::string, Written> tensors;

  std::string bytes() const {
    std::string header = "{\"__metadata__\":{";
    for (const auto& [name, text] : metadata) {
      if (header.back() != '{') header += ',';
      header.append("\"").append(name).append("\":\"").append(text).append("\"");
    }
    header += '}';
    std::string values;
    for (const auto& [name, tensor] : tensors) {
      const std::size_t begin = values.size();
      for (const double value : tensor.values) {
        if (tensor.dtype == "F32") {
          append(static_cast<float>(value), values);
        } else {
          append(value, values);
        }
      }
      header += ",\"" + name + "\":{\"dtype\":\"" + tensor.dtype + "\",\"shape\":[";
      for (std::size_t i = 0; i < tensor.shape.size(); ++i) {
        header += (i == 0 ? "" : ",") + std::to_string(tensor.shape[i]);
      }
      header += "],\"data_offsets\":[" + std::to_string(begin) + "," +
                std::to_string(values.size()) + "]}";
    }
    return with_size(header + '}') + values;
  }
};

/// Policy with two observations, a hidden layer of two and one action.
inline PolicyBytes small_policy() {
  PolicyBytes policy;
  policy.metadata = {{"format", "walker_sim policy 1"},
                     {"id", "Toy-v0"},
                     {"activation", "tanh"},
                     {"output", "clip"},
                     {"layers", "2"},
                     {"steps", "12"}};
  policy.tensors = {
      {"observation.mean", {"F64", {2}, {1, -1}}},
      {"observation.deviation", {"F64", {2}, {2, 0.5}}},
      {"action.low", {"F32", {1}, {-1}}},
      {"action.high", {"F32", {1}, {1}}},
      {"layers.0.weight", {"F32", {2, 2}, {1, 2, 3, 4}}},
      {"layers.0.bias", {"F32", {2}, {0.1, -0.2}}},
      {"layers.1.weight", {"F32", {1, 2}, {0.5, -0.25}}},
      {"layers.1.bias", {"F32", {1}, {0.05}}},
  };
  return policy;
}

}  // namespace walker
