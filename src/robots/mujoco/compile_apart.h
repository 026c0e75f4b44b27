// Compiles an untrusted model in a process of its own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace walker::mujoco {

/// Size of mj_loadXML's error buffer [bytes].
constexpr int kMaxErrorBytes = 1000;

/// Resource limits of one compilation.
struct CompileLimits {
  std::size_t memory = std::size_t{2} << 30U;  ///< address space beyond the program's own [bytes]
  unsigned int processor_seconds = 30;         ///< of CPU time
  unsigned int idle_seconds = 10;              ///< without CPU use
  std::size_t elements = 20000;                ///< XML elements, included files counted
  std::size_t bytes = std::size_t{64} << 20U;  ///< of XML text, included files counted
};

/// What the program `compile_model` writes before its message.
struct CompileHeading {
  std::uint64_t is_model;  ///< 0: the message is the reason why there is no model
  std::uint64_t size;      ///< of the message [bytes]
};

/// Compiles a model by the program `compile_model`, which is installed with this library. MuJoCo's
/// compiler trusts the sizes and file names in a model, so some models make it crash, exit, exhaust
/// the memory or block forever; this ends only that program.
///
/// @param path MJCF file
/// @param text its content; null: the file is read
/// @return the compiled model in the format of mj_saveModel; mj_makeData and mj_forward accept it
/// @throws std::runtime_error with MuJoCo's message, the exceeded limit, how the program ended, or
///         why it cannot be started; Interrupted
std::vector<std::byte> compile_apart(const std::string& path, const CompileLimits& limits = {},
                                     const std::string* text = nullptr);

}  // namespace walker::mujoco
