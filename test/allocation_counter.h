// Counts heap allocations. Replaces the operators new and delete, so include it only once a
// program.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <vector>

namespace walker {

inline std::atomic<int> allocations{0};
inline std::atomic<bool> is_counting{false};

/// @return null if memory is exhausted
inline void* try_allocate(std::size_t size) noexcept {
  if (is_counting) ++allocations;
  return std::malloc(size == 0 ? 1 : size);
}

inline void* allocate(std::size_t size) {
  if (void* memory = try_allocate(size)) return memory;
  throw std::bad_alloc();
}

class Counting {
 public:
  Counting() { is_counting = true; }
  Counting(const Counting&) = delete;
  Counting& operator=(const Counting&) = delete;
  ~Counting() { is_counting = false; }
};

/// Fails if the replaced operators do not count.
class AllocationTest : public testing::Test {
 protected:
  void SetUp() override {
    std::vector<std::vector<double>> kept;
    allocations = 0;
    {
      const Counting counting;
      kept.emplace_back(10);
    }
    ASSERT_EQ(allocations, 2);
    kept.emplace_back(10);
    ASSERT_EQ(allocations, 2);
    allocations = 0;
  }
};

}  // namespace walker

// noinline: if only one operator of a pair is inlined, compilers warn about a mismatch.
[[gnu::noinline]] void* operator new(std::size_t size) { return walker::allocate(size); }
[[gnu::noinline]] void* operator new[](std::size_t size) { return walker::allocate(size); }
// Replaced too: a sanitizer's nothrow new would not match the deletes below.
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t& /*any*/) noexcept {
  return walker::try_allocate(size);
}
[[gnu::noinline]] void* operator new[](std::size_t size, const std::nothrow_t& /*any*/) noexcept {
  return walker::try_allocate(size);
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t /*size*/) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete[](void* memory, std::size_t /*size*/) noexcept {
  std::free(memory);
}
