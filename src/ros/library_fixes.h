// Replacements for functions of roscpp's libraries that can terminate the process.
#pragma once

namespace walker {

/// Does nothing; a call makes the linker include library_fixes.cpp, which replaces the libraries'
/// functions. The package itself calls none of those.
void use_library_fixes();

}  // namespace walker
