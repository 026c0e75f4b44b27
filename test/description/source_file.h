// Files of the package's source.
#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

namespace walker {

inline std::string read_source(const std::string& path) {
  std::ifstream file(WALKER_SIM_SOURCE_DIR "/" + path, std::ios::binary);
  if (!file) ADD_FAILURE() << path << ": cannot be read";
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace walker
