// Per-thread scratch memory of kernels. It has hundreds of KiB; a thread's stack may have only 128.
#pragma once

#include <cstddef>

namespace walker::simd {

/// Both parts are used at the same time: one for a group of instances, the other for the lanes in
/// which a kernel solves them. Their contents are undefined between calls.
struct LaneMemory {
  static constexpr std::size_t kAlignment = 64;
  static constexpr std::size_t kGroupSize = std::size_t{512} << 10U;
  static constexpr std::size_t kLanesSize = std::size_t{384} << 10U;

  alignas(kAlignment) std::byte group[kGroupSize];
  alignas(kAlignment) std::byte lanes[kLanesSize];
};

/// The calling thread's memory, allocated by its first call and freed when it ends.
/// @throws std::bad_alloc
LaneMemory& lane_memory();

}  // namespace walker::simd
