// A pool of threads, which work on numbered items together with the thread that hands these out.
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

/// How many processors this thread may use, at least 1.
std::size_t num_processors();

/// A ring of small numbers with one producer and many consumers, without locks. The producer never
/// puts more items than `capacity` before some are taken.
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

/// Each thread has the same slice of the items every time, since its processor's caches know them,
/// and takes from the others' once it has done its own. The thread that made the pool is one of
/// them: it alone calls, and works in `collect`.
///
/// No call takes a lock or memory. Threads without work wait awake for a while, then sleep
/// in the kernel.
class ThreadPool {
 public:
  /// Works on some items; must not throw. What it writes, whoever collects the items sees.
  using Work = std::function<void(const std::uint32_t* items, std::size_t count)>;

  /// @param num_items   0 .. num_items - 1
  /// @param num_threads at least 1, the caller's among them
  /// @param group_size  most items that `work` gets at once, 1 .. kMaxGroupSize
  ThreadPool(std::size_t num_items, std::size_t num_threads, std::size_t group_size, Work work);
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;
  /// Items that nobody has begun with are dropped.
  ~ThreadPool();

  /// Puts an item on its thread's list. It must have been collected since it was added last.
  void add(std::uint32_t item) { queues_[thread_of_[item]].put(item); }

  /// Lets the threads begin with what was added.
  /// @param num_wanted threads besides the caller that there is work for
  void start(std::size_t num_wanted);

  /// Works along until `count` items are done that were not collected before.
  /// @param items caller's, `count` of those that were done first, in that order
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
  bool has_processors_;                   // one for each thread
  std::vector<std::uint32_t> thread_of_;  // by item
  std::deque<WorkQueue> queues_;          // by thread

  // Items that are done, in their order: a ring of item + 1, 0 where none is yet.
  std::vector<std::atomic<std::uint32_t>> done_;
  std::uint64_t num_collected_ = 0;

  alignas(kCacheLine) std::atomic<std::uint64_t> num_places_{0};  // given out in `done_`
  std::atomic<std::uint32_t> num_done_{0};                        // wraps, as the kernel's words do
  alignas(kCacheLine) std::atomic<std::uint32_t> awaited_{0};     // num_done_ the caller sleeps for
  std::atomic<bool> caller_sleeps_{false};
  std::atomic<bool> is_stopping_{false};
  alignas(kCacheLine) std::atomic<std::uint32_t> num_starts_{0};  // wraps
  std::atomic<std::uint32_t> num_sleepers_{0};

  std::vector<std::thread> threads_;
};

}  // namespace walker
