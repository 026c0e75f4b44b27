#include "simd/lane_memory.h"

#include <memory>

namespace walker::simd {

LaneMemory& lane_memory() {
  // Only the pointer is thread-local: the C library takes thread-local memory from the stack.
  // NOLINTNEXTLINE(modernize-make-unique)  // make_unique would zero all of it
  thread_local const std::unique_ptr<LaneMemory> kMemory(new LaneMemory);
  return *kMemory;
}

}  // namespace walker::simd
