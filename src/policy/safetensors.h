// Safetensors: eight bytes of length, a JSON header, then the tensors' values, little-endian.
// https://github.com/huggingface/safetensors, "Format".
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace walker {

struct Tensor {
  std::vector<std::size_t> shape;
  std::vector<double> values;  ///< row by row; single precision fits without loss
};

struct Tensors {
  std::map<std::string, std::string> metadata;
  std::map<std::string, Tensor> by_name;
};

/// @param data a whole file
/// @throws std::invalid_argument saying what is wrong with it
Tensors read_safetensors(const std::vector<char>& data);

}  // namespace walker
