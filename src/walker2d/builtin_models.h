// The models of assets/walker2d_v4.xml and assets/walker2d_v5.xml, built into the library: nothing
// has to be found at run time. CMake fills their text into builtin_models.cpp.in.
#pragma once

#include <array>

namespace walker::walker2d {

struct BuiltinModel {
  const char* name;  // the file's name, without a folder
  const char* text;  // MJCF
};

extern const std::array<BuiltinModel, 2> kBuiltinModels;

}  // namespace walker::walker2d
