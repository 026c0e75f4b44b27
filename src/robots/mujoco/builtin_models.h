// The models of assets/, embedded in the library. CMake inserts them into builtin_models.cpp.in.
#pragma once

#include <string>
#include <vector>

namespace walker::mujoco {

struct BuiltinModel {
  std::string name;  ///< file name without directory
  std::string text;  ///< MJCF
};

/// Returns every *.xml of assets/.
const std::vector<BuiltinModel>& builtin_models();

}  // namespace walker::mujoco
