// A pool of threads, which work on numbered items together with the thread that hands these out.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <thread>
#include <vector>

#include "base/limits.h"
#include "episode/parking.h"
#include "episode/work_queue.h"

namespace walker {

/// Each thread has the same slice of the items every time, since its processor's caches know them,
/// and takes from the others' once it has done its own. The thread that made the pool is one of
/// them: it alone calls, and works in `collect`.
///
/// No call takes a lock or memory. Threads without work wait awake for a while, then sleep
/// (parking.h).
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
  Awake awake_;
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
