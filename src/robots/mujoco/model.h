// Compiled models, shared by all environments that use them.
#pragma once

#include <cstdint>
#include <string>

#include "robots/mujoco/engine.h"

namespace walker::mujoco {

/// Compiles a model, or returns the compiled one that another environment still holds.
///
/// @param xml_file name of a built-in model, such as "walker2d_v5.xml", else the path of an MJCF
///                 file; it may begin with ~/
/// @throws std::invalid_argument with the file's name and MuJoCo's words where it does not compile;
///         std::runtime_error if the processor cannot run MuJoCo; Interrupted
ModelPointer load_model(const std::string& xml_file);

/// Alike for models that are alike in all that MuJoCo would save of them.
std::uint64_t fingerprint(const mjModel& model);

/// @param reason may be MuJoCo's words, which have several lines
/// @throws std::invalid_argument with the file's name and, in one line, the reason
[[noreturn]] void refuse_model(const std::string& xml_file, std::string reason);

}  // namespace walker::mujoco
