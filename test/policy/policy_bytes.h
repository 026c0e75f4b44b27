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

}  // namespace walker
