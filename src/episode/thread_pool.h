// A thread pool for numbered items, in which the calling thread takes part.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <thread>
#include <vector>

#include "base/limits.h"

namespace walker {

/// Returns the number of processors in this thread's affinity mask, at least 1.
std::size_t num_processors();

/// A lock-free ring buffer with one producer and many consumers. The producer must not put an item
/// while `capacity` items are in the ring.
class WorkQueue {
 public:
  explicit WorkQueue(std::size_t capacity) : ring_(std::max<std::size_t>(capacity, 1)) {}

  /// Producer only. Consumers cannot take the item before `publish`.
  void put(std::uint32_t item) {
    ring_[put_++ % ring_.size()].store(item, std::memory_order_relaxed);
  }

  /// Producer only. Makes the items available to consumers.
  void publish() { end_.store(put_, std::memory_order_release); }

  /// Takes up to `most` of the oldest items. Any thread may call it.
  /// @return the number of items; 0: the ring is empty
  std::size_t take(std::uint32_t* items, std::size_t most) {
    std::uint64_t begin = begin_.load(std::memory_order_acquire);
    while (true) {
      const std::uint64_t end = end_.load(std::memory_order_acquire);
      if (begin >= end) return 0;
      const std::size_t count = std::min<std::size_t>(most, end - begin);
      // The items are read before they are claimed, as the producer may then reuse their places. If
      // another thread claims them first, the exchange fails and the loop reads again.
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
  // Consumers and producer write to separate cache lines.
  alignas(kCacheLine) std::atomic<std::uint64_t> begin_{0};  // number of items taken
  alignas(kCacheLine) std::atomic<std::uint64_t> end_{0};    // number of items published
  std::uint64_t put_ = 0;                                    // number of items put; never wraps
  std::vector<std::atomic<std::uint32_t>> ring_;
};

/// Each thread owns a fixed slice of the items, which stay in its processor's caches, and steals
/// from the other slices once its own is done. The thread that constructed the pool is thread 0: it
/// alone may call the methods, and works on items in `collect`.
///
/// No method locks or allocates. Idle threads spin for a while, then sleep in the kernel.
class ThreadPool {
 public:
  /// Processes items; must not throw. Its writes are visible to the thread that collects the items.
  using Work = std::function<void(const std::uint32_t* items, std::size_t count)>;

  /// @param num_items   items are 0 .. num_items - 1
  /// @param num_threads at least 1, including the caller's
  /// @param group_size  upper bound of the items in one call of `work`, 1 .. kMaxGroupSize
  ThreadPool(std::size_t num_items, std::size_t num_threads, std::size_t group_size, Work work);
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;
  /// Joins the threads. Items that no thread has started are dropped.
  ~ThreadPool();

  /// Queues an item for its thread. An item must be collected before it is added again.
  void add(std::uint32_t item) { queues_[thread_of_[item]].put(item); }

  /// Publishes the added items and wakes sleeping threads.
  /// @param num_wanted upper bound of the threads to wake
  void start(std::size_t num_wanted);

  /// Processes items until `count` uncollected ones are done, and collects these.
  /// @param items receives `count` items in the order of completion
  void collect(std::size_t count, std::uint32_t* items);

 private:
  void make_slices(std::size_t num_threads);
  void stop();
  void run(std::size_t thread);
  bool work_once(std::size_t thread);
  void report(const std::uint32_t* items, std::size_t count);
  void await(std::uint32_t awaited);
  std::uint32_t next_done();

  std::size_t num_items_;
  std::size_t group_size_;
  Work work_;
  bool has_processors_;                   // as many processors as threads
  std::vector<std::uint32_t> thread_of_;  // by item
  std::deque<WorkQueue> queues_;          // by thread

  // Ring of the done items in the order of completion, stored as item + 1; 0: empty.
  std::vector<std::atomic<std::uint32_t>> done_;
  std::uint64_t num_collected_ = 0;

  alignas(kCacheLine) std::atomic<std::uint64_t> num_places_{0};  // places reserved in `done_`
  std::atomic<std::uint32_t> num_done_{0};                        // wraps: a futex has 32 bits
  alignas(kCacheLine) std::atomic<std::uint32_t> awaited_{0};     // num_done_ the caller awaits
  std::atomic<bool> caller_sleeps_{false};
  std::atomic<bool> is_stopping_{false};
  alignas(kCacheLine) std::atomic<std::uint32_t> num_starts_{0};  // wraps
  std::atomic<std::uint32_t> num_sleepers_{0};

  std::vector<std::thread> threads_;
};

}  // namespace walker
