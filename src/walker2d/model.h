// Compiled models, shared by all environments that use them.
#pragma once

#include <string>

#include "walker2d/mujoco.h"

namespace walker::walker2d {

/// Compiles a model, or returns the compiled one that another environment still holds.
///
/// @param xml_file "walker2d_v4.xml" or "walker2d_v5.xml", which are built in, else the path of an
///                 MJCF file; it may begin with ~/
/// @throws std::invalid_argument with the file's name and MuJoCo's words where it does not
///         compile, or with what is wrong where its joints or actuators are not a planar walker's
ModelPointer load_model(const std::string& xml_file);

}  // namespace walker::walker2d
