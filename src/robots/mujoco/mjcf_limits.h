// Limits of users' models, which MuJoCo's compiler does not check.
#pragma once

#include <string>

namespace walker::mujoco {

/// Checks the sizes that an MJCF file and the files that it includes request, and that the files
/// which it names are regular. MuJoCo's compiler trusts them: it would crash, exhaust the memory,
/// work for hours or block forever. Leaves errors that MuJoCo reports to MuJoCo: the XML is not
/// validated, and missing files are ignored.
/// @throws std::runtime_error naming the size and its limit
void check_mjcf(const std::string& path);

}  // namespace walker::mujoco
