// A thread pool for numbered items, in which the calling thread takes part.
#pragma once

#include <linux/futex.h>
#include <sched.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <deque>
#include <functional>
#include <limits>
#include <new>
#include <thread>
#include <utility>
#include <vector>

#include "base/limits.h"
#include "simd/lane_memory.h"

namespace walker {

/// Returns the number of processors in this thread's affinity mask, at least 1.
inline std::size_t num_processors() {
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof(set), &set) != 0) return 1;  // more processors than the set holds
  return static_cast<std::size_t>(std::max(CPU_COUNT(&set), 1));
}

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
  ThreadPool(std::size_t num_items, std::size_t num_threads, std::size_t group_size, Work work)
      : num_items_(num_items),
        group_size_(group_size),
        work_(std::move(work)),
        has_processors_(num_threads <= num_processors()),
        thread_of_(num_items),
        done_(num_items) {
    make_slices(num_threads);
    simd::lane_memory();  // allocates this thread's lane memory, so that no step has to
    try {
      for (std::size_t i = 1; i < num_threads; ++i) threads_.emplace_back([this, i] { run(i); });
    } catch (...) {
      stop();
      throw;
    }
  }
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;
  /// Joins the threads. Items that no thread has started are dropped.
  ~ThreadPool() { stop(); }

  /// Queues an item for its thread. An item must be collected before it is added again.
  void add(std::uint32_t item) { queues_[thread_of_[item]].put(item); }

  /// Publishes the added items and wakes sleeping threads.
  /// @param num_wanted upper bound of the threads to wake
  void start(std::size_t num_wanted) {
    for (WorkQueue& queue : queues_) queue.publish();
    // Sequentially consistent, as are a sleeper's increment of num_sleepers_ and the comparison in
    // its futex call: either the sleeper sees the start, or this thread counts the sleeper.
    num_starts_.fetch_add(1);
    const std::size_t num_woken = std::min<std::size_t>(num_wanted, num_sleepers_.load());
    if (num_woken != 0) futex_wake(num_starts_, static_cast<int>(num_woken));
  }

  /// Processes items until `count` uncollected ones are done, and collects these.
  /// @param items receives `count` items in the order of completion
  /// @param check called between items and while waiting. What it throws ends the call, which has
  ///              then collected no item; threads continue with those that have been started
  template <typename Check>
  void collect(std::size_t count, std::uint32_t* items, const Check& check) {
    const auto awaited = static_cast<std::uint32_t>(num_collected_ + count);
    while (is_before(num_done_.load(), awaited) && work_once(0)) check();
    await(awaited, check);
    std::generate_n(items, count, [this] { return next_done(); });
  }
  void collect(std::size_t count, std::uint32_t* items) {
    collect(count, items, [] {});
  }

 private:
  // The futex calls read the number as a plain 32-bit word.
  static_assert(sizeof(std::atomic<std::uint32_t>) == sizeof(std::uint32_t));
  static_assert(std::atomic<std::uint32_t>::is_always_lock_free);

  /// Hints to the processor that the thread is spinning.
  static void cpu_pause() {
#ifdef __x86_64__
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    asm volatile("yield");
#endif
  }

  /// Spins up to 150 us until `number` differs from `old`.
  /// @param keeps_processor if false, yields the processor in each round; the scheduler may then
  ///                        run another thread for milliseconds
  /// @return whether the number changed
  static bool spin_while_equal(const std::atomic<std::uint32_t>& number, std::uint32_t old,
                               bool keeps_processor) {
    using Clock = std::chrono::steady_clock;
    constexpr std::chrono::microseconds kMaxSpin(150);  // measured in docs/pool.md
    const Clock::time_point end = Clock::now() + kMaxSpin;
    do {
      if (number.load(std::memory_order_acquire) != old) return true;
      if (keeps_processor) {
        cpu_pause();
      } else {
        std::this_thread::yield();
      }
    } while (Clock::now() < end);
    return false;
  }

  /// Sleeps until `futex_wake` if `number` equals `old`. May wake spuriously.
  /// @param timeout null: none
  static void futex_wait(const std::atomic<std::uint32_t>& number, std::uint32_t old,
                         const timespec* timeout) {
    syscall(SYS_futex, &number, FUTEX_WAIT_PRIVATE, old, timeout, nullptr, 0);
  }

  static void futex_wake(const std::atomic<std::uint32_t>& number, int count) {
    syscall(SYS_futex, &number, FUTEX_WAKE_PRIVATE, count, nullptr, nullptr, 0);
  }

  /// Whether `count` is below `other`, for counts that wrap around.
  static bool is_before(std::uint32_t count, std::uint32_t other) {
    return static_cast<std::int32_t>(count - other) < 0;
  }

  void make_slices(std::size_t num_threads) {
    // Slices are whole groups, so that as few groups as possible are incomplete.
    const std::size_t num_groups = (num_items_ + group_size_ - 1) / group_size_;
    std::size_t begin = 0;
    for (std::size_t i = 1; i <= num_threads; ++i) {
      const std::size_t end = std::min(num_items_, num_groups * i / num_threads * group_size_);
      std::fill(thread_of_.begin() + begin, thread_of_.begin() + end, i - 1);
      queues_.emplace_back(end - begin);
      begin = end;
    }
  }

  void stop() {
    is_stopping_.store(true, std::memory_order_relaxed);
    num_starts_.fetch_add(1);
    futex_wake(num_starts_, std::numeric_limits<int>::max());
    for (std::thread& thread : threads_) thread.join();
  }

  void run(std::size_t thread) {
    try {
      simd::lane_memory();
    } catch (const std::bad_alloc&) {  // NOLINT(bugprone-empty-catch): a step that needs it fails
    }
    while (true) {
      const std::uint32_t num_starts = num_starts_.load();
      if (is_stopping_.load(std::memory_order_relaxed)) return;
      if (work_once(thread) || spin_while_equal(num_starts_, num_starts, has_processors_)) continue;
      num_sleepers_.fetch_add(1);
      futex_wait(num_starts_, num_starts, nullptr);
      num_sleepers_.fetch_sub(1);
    }
  }

  bool work_once(std::size_t thread) {
    std::array<std::uint32_t, kMaxGroupSize> items;
    for (std::size_t i = 0; i < queues_.size(); ++i) {
      WorkQueue& queue = queues_[(thread + i) % queues_.size()];
      const std::size_t count = queue.take(items.data(), group_size_);
      if (count == 0) continue;
      work_(items.data(), count);
      report(items.data(), count);
      return true;
    }
    return false;
  }

  void report(const std::uint32_t* items, std::size_t count) {
    const std::uint64_t place = num_places_.fetch_add(count, std::memory_order_acq_rel);
    for (std::size_t i = 0; i < count; ++i) {
      done_[(place + i) % num_items_].store(items[i] + 1, std::memory_order_release);
    }
    // As in `start`: either the caller sees the new count, or this thread sees that it sleeps.
    const auto more = static_cast<std::uint32_t>(count);
    const std::uint32_t num_done = num_done_.fetch_add(more) + more;
    if (caller_sleeps_.load() && !is_before(num_done, awaited_.load())) futex_wake(num_done_, 1);
  }

  template <typename Check>
  void await(std::uint32_t awaited, const Check& check) {
    constexpr timespec kCheckInterval{0, 50'000'000};
    while (true) {
      const std::uint32_t num_done = num_done_.load();
      if (!is_before(num_done, awaited)) return;
      check();
      if (spin_while_equal(num_done_, num_done, has_processors_)) continue;
      awaited_.store(awaited);
      caller_sleeps_.store(true);
      futex_wait(num_done_, num_done, &kCheckInterval);
      caller_sleeps_.store(false);
    }
  }

  std::uint32_t next_done() {
    std::atomic<std::uint32_t>& place = done_[num_collected_++ % num_items_];
    std::uint32_t item = 0;
    // Another thread may not yet have filled the place that it reserved, while later ones are full.
    while ((item = place.load(std::memory_order_acquire)) == 0) std::this_thread::yield();
    place.store(0, std::memory_order_relaxed);
    return item - 1;
  }

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
