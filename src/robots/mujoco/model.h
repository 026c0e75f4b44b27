// Models: those of assets/, and compiled ones, shared by all environments that use them.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "robots/mujoco/engine.h"

namespace walker::mujoco {

/// Returns the MJCF text of every *.xml of assets/ by file name. CMake inserts them into
/// builtin_models.cpp.in.
const std::map<std::string, std::string>& builtin_models();

/// Compiles a model, or returns the compiled one that another environment holds.
///
/// @param xml_file name of a built-in model, such as "walker2d_v5.xml", else the path of an MJCF
///                 file; it may begin with ~/
/// @throws std::invalid_argument with the file's name and MuJoCo's message if it does not compile;
///         std::runtime_error if the processor cannot run MuJoCo; Interrupted
ModelPointer load_model(const std::string& xml_file);

/// Returns a hash of the model's binary form, as mj_saveModel writes it.
std::uint64_t fingerprint(const mjModel& model);

/// Returns how a message about a model begins: with its file's name and a colon.
std::string describe_model(const std::string& xml_file);

/// @param reason may have several lines, as MuJoCo's messages do
/// @throws std::invalid_argument with the file's name and the reason, in one line
[[noreturn]] void refuse_model(const std::string& xml_file, std::string reason);

}  // namespace walker::mujoco
