// Safetensors: the header's length in 8 bytes, a JSON header, then the values, little-endian.
// https://github.com/huggingface/safetensors, "Format".
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace walker {

struct Tensor {
  std::vector<std::size_t> shape;
  std::vector<double> values;  ///< row-major; single precision converts without loss
};

struct Tensors {
  std::map<std::string, std::string> metadata;
  std::map<std::string, Tensor> by_name;
};

/// @param data content of a whole file
/// @throws std::invalid_argument naming the fault
Tensors read_safetensors(const std::vector<char>& data);

}  // namespace walker
