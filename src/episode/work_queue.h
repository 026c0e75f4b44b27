// A queue of small numbers with one producer and many consumers, without locks.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/limits.h"

namespace walker {

/// A ring. The producer never puts more items than `capacity` before some are taken.
class WorkQueue {
 public:
  explicit WorkQueue(std::size_t capacity) : ring_(std::max<std::size_t>(capacity, 1)) {}

  /// The producer's. Nobody sees the item before `publish`.
  void put(std::uint32_t item) {
    ring_[put_++ % ring_.size()].store(item, std::memory_order_relaxed);
  }

  /// The producer's: what was put can be taken.
  void publish() { end_.store(put_, std::memory_order_release); }

  /// Any thread's. Takes the oldest items, `most` or fewer.
  /// @return how many; 0: there are none
  std::size_t take(std::uint32_t* items, std::size_t most) {
    std::uint64_t begin = begin_.load(std::memory_order_acquire);
    while (true) {
      const std::uint64_t end = end_.load(std::memory_order_acquire);
      if (begin >= end) return 0;
      const std::size_t count = std::min<std::size_t>(most, end - begin);
      // Read before they are taken, for afterwards the producer may reuse their places. If another
      // thread takes them meanwhile, they are read again.
      for (std::size_t i = 0; i < count; ++i) {
        items[i] = ring_[(begin + i) % ring_.size()].load(std::memory_order_relaxed);
      }
      if (begin_.compare_exchange_weak(begin, begin + count, std::memory_order_acq_rel,
                                       std::memory_order_acquire)) {
        return count;
      }
    }
  }

 private:
  // What consumers write does not share a cache line with what the producer writes.
  alignas(kCacheLine) std::atomic<std::uint64_t> begin_{0};  // taken
  alignas(kCacheLine) std::atomic<std::uint64_t> end_{0};    // published
  std::uint64_t put_ = 0;                                    // the producer's; never wraps
  std::vector<std::atomic<std::uint32_t>> ring_;
};

}  // namespace walker
