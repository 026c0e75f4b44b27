#include "episode/thread_pool.h"

#include <linux/futex.h>
#include <sched.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <limits>
#include <new>
#include <utility>

#include "simd/workspace.h"

namespace walker {
namespace {

// The futex calls read the number as a plain 32-bit word.
static_assert(sizeof(std::atomic<std::uint32_t>) == sizeof(std::uint32_t));
static_assert(std::atomic<std::uint32_t>::is_always_lock_free);

/// Hints to the processor that the thread is spinning.
void cpu_pause() {
#ifdef __x86_64__
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

/// Spins up to 150 us until `number` differs from `old`.
/// @param keeps_processor if false, yields the processor in each round; the scheduler may then run
///                        another thread for milliseconds
/// @return whether the number changed
bool spin_while_equal(const std::atomic<std::uint32_t>& number, std::uint32_t old,
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
void futex_wait(const std::atomic<std::uint32_t>& number, std::uint32_t old) {
  syscall(SYS_futex, &number, FUTEX_WAIT_PRIVATE, old, nullptr, nullptr, 0);
}

void futex_wake(const std::atomic<std::uint32_t>& number, int count) {
  syscall(SYS_futex, &number, FUTEX_WAKE_PRIVATE, count, nullptr, nullptr, 0);
}

/// Whether `count` is below `other`, for counts that wrap around.
bool is_before(std::uint32_t count, std::uint32_t other) {
  return static_cast<std::int32_t>(count - other) < 0;
}

}  // namespace

std::size_t num_processors() {
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof(set), &set) != 0) return 1;  // more processors than the set holds
  return static_cast<std::size_t>(std::max(CPU_COUNT(&set), 1));
}

ThreadPool::ThreadPool(std::size_t num_items, std::size_t num_threads, std::size_t group_size,
                       Work work)
    : num_items_(num_items),
      group_size_(group_size),
      work_(std::move(work)),
      has_processors_(num_threads <= num_processors()),
      thread_of_(num_items),
      done_(num_items) {
  make_slices(num_threads);
  simd::workspace();  // allocates this thread's workspace, so that no step has to
  try {
    for (std::size_t i = 1; i < num_threads; ++i) threads_.emplace_back([this, i] { run(i); });
  } catch (...) {
    stop();
    throw;
  }
}

ThreadPool::~ThreadPool() { stop(); }

void ThreadPool::make_slices(std::size_t num_threads) {
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

void ThreadPool::stop() {
  is_stopping_.store(true, std::memory_order_relaxed);
  num_starts_.fetch_add(1);
  futex_wake(num_starts_, std::numeric_limits<int>::max());
  for (std::thread& thread : threads_) thread.join();
}

void ThreadPool::start(std::size_t num_wanted) {
  for (WorkQueue& queue : queues_) queue.publish();
  // Sequentially consistent, as are a sleeper's increment of num_sleepers_ and the comparison in
  // its futex call: either the sleeper sees the start, or this thread counts the sleeper.
  num_starts_.fetch_add(1);
  const std::size_t num_woken = std::min<std::size_t>(num_wanted, num_sleepers_.load());
  if (num_woken != 0) futex_wake(num_starts_, static_cast<int>(num_woken));
}

void ThreadPool::run(std::size_t thread) {
  try {
    simd::workspace();
  } catch (const std::bad_alloc&) {  // NOLINT(bugprone-empty-catch)  // a step that needs it fails
  }
  while (true) {
    const std::uint32_t num_starts = num_starts_.load();
    if (is_stopping_.load(std::memory_order_relaxed)) return;
    if (work_once(thread) || spin_while_equal(num_starts_, num_starts, has_processors_)) continue;
    num_sleepers_.fetch_add(1);
    futex_wait(num_starts_, num_starts);
    num_sleepers_.fetch_sub(1);
  }
}

bool ThreadPool::work_once(std::size_t thread) {
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

void ThreadPool::report(const std::uint32_t* items, std::size_t count) {
  const std::uint64_t place = num_places_.fetch_add(count, std::memory_order_acq_rel);
  for (std::size_t i = 0; i < count; ++i) {
    done_[(place + i) % num_items_].store(items[i] + 1, std::memory_order_release);
  }
  // As in `start`: either the caller sees the new count, or this thread sees that it sleeps.
  const auto more = static_cast<std::uint32_t>(count);
  const std::uint32_t num_done = num_done_.fetch_add(more) + more;
  if (caller_sleeps_.load() && !is_before(num_done, awaited_.load())) futex_wake(num_done_, 1);
}

void ThreadPool::collect(std::size_t count, std::uint32_t* items) {
  const auto awaited = static_cast<std::uint32_t>(num_collected_ + count);
  while (is_before(num_done_.load(), awaited) && work_once(0)) {
  }
  await(awaited);
  std::generate_n(items, count, [this] { return next_done(); });
}

void ThreadPool::await(std::uint32_t awaited) {
  while (true) {
    const std::uint32_t num_done = num_done_.load();
    if (!is_before(num_done, awaited)) return;
    if (spin_while_equal(num_done_, num_done, has_processors_)) continue;
    awaited_.store(awaited);
    caller_sleeps_.store(true);
    futex_wait(num_done_, num_done);
    caller_sleeps_.store(false);
  }
}

std::uint32_t ThreadPool::next_done() {
  std::atomic<std::uint32_t>& place = done_[num_collected_++ % num_items_];
  std::uint32_t item = 0;
  // Another thread may have reserved the place and not yet filled it, while later ones are filled.
  while ((item = place.load(std::memory_order_acquire)) == 0) std::this_thread::yield();
  place.store(0, std::memory_order_relaxed);
  return item - 1;
}

}  // namespace walker
