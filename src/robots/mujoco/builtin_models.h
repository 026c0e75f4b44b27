// The models of assets/, built into the library: nothing has to be found at run time. CMake fills
// their texts into builtin_models.cpp.in.
#pragma once

#include <string>
#include <vector>

namespace walker::mujoco {

struct BuiltinModel {
  std::string name;  ///< the file's, without a folder
  std::string text;  ///< MJCF
};

/// Of each *.xml in assets/.
const std::vector<BuiltinModel>& builtin_models();

}  // namespace walker::mujoco
