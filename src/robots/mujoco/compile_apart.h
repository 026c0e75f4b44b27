// Compiles an untrusted model in a child process.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "robots/mujoco/engine.h"

namespace walker::mujoco {

/// Size of mj_loadXML's error buffer [bytes].
constexpr int kMaxErrorBytes = 1000;

/// Resource limits of one compilation.
struct CompileLimits {
  std::size_t memory = std::size_t{2} << 30U;  ///< address space beyond the parent's [bytes]
  unsigned int processor_seconds = 30;         ///< of CPU time
  unsigned int idle_seconds = 10;              ///< without CPU use; one retry
  std::size_t elements = 20000;                ///< XML elements, included files counted
  std::size_t bytes = std::size_t{64} << 20U;  ///< of XML text, included files counted
};

/// Compiles a model in a forked child process. MuJoCo's compiler trusts the sizes and file names in
/// a model, so some models make it crash, exit, exhaust the memory or block forever; here that ends
/// only the child. The child inherits the caller's settings, except for the locale.
///
/// @param path  MJCF file
/// @param files MuJoCo's virtual file system; null: none
/// @return the compiled model in the format of mj_saveModel; mj_makeData and mj_forward accept it
/// @throws std::runtime_error with MuJoCo's message, the exceeded limit, or how the child ended;
///         Interrupted
std::vector<std::byte> compile_apart(const std::string& path, const CompileLimits& limits = {},
                                     const mjVFS* files = nullptr);

}  // namespace walker::mujoco
