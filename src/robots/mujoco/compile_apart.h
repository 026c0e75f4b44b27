// Compiles a model of a stranger's in a process of its own.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "robots/mujoco/engine.h"

namespace walker::mujoco {

/// Size of the buffer for an error of mj_loadXML [bytes].
constexpr int kMaxErrorBytes = 1000;

/// What compiling a model may take.
struct CompileLimits {
  std::size_t memory = std::size_t{2} << 30U;  ///< [bytes] of model and data, sources included
  unsigned int processor_seconds = 30;
  unsigned int idle_seconds = 10;              ///< of waiting for what does not come, twice
  std::size_t elements = 20000;                ///< of XML, in the file and those that it includes
  std::size_t bytes = std::size_t{64} << 20U;  ///< of their text
};

/// MuJoCo's compiler believes what a model says of sizes, and reads what it names: there are models
/// at which it crashes, ends its process, fills the memory or waits for ever. Here that ends a
/// child process. The calling process is forked, so what it has set is set there too,
/// but for the locale.
///
/// @param path of an MJCF file
/// @param files that MuJoCo finds in memory; null: none
/// @return the compiled model as mj_saveModel has it, of which data can be made and stepped
/// @throws std::runtime_error with MuJoCo's words, with the limit that the model exceeds, or with
///         what became of the child; Interrupted
std::vector<std::byte> compile_apart(const std::string& path, const CompileLimits& limits = {},
                                     const mjVFS* files = nullptr);

}  // namespace walker::mujoco
