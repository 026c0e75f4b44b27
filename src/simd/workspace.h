// Memory of a thread for what a kernel is in the midst of: hundreds of KiB, and a thread's stack
// may have 128.
#pragma once

#include <cstddef>

namespace walker::simd {

/// The two parts are used at the same time: a group of worlds, and the lanes in which a kernel
/// solves them. Their contents are undefined between calls.
struct Workspace {
  static constexpr std::size_t kAlignment = 64;
  static constexpr std::size_t kGroupSize = std::size_t{512} << 10U;
  static constexpr std::size_t kLanesSize = std::size_t{256} << 10U;

  alignas(kAlignment) std::byte group[kGroupSize];
  alignas(kAlignment) std::byte lanes[kLanesSize];
};

/// The calling thread's. Allocated by its first call, freed when the thread ends.
/// @throws std::bad_alloc
Workspace& workspace();

}  // namespace walker::simd
