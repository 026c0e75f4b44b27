// Every started item is processed once and collected once.
#include "episode/thread_pool.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <numeric>
#include <thread>

namespace walker {
namespace {

/// Counts the work on each item in non-atomic memory, which the threads hand over.
class Counters {
 public:
  Counters(std::size_t num_items, std::size_t num_threads, std::size_t group_size = 1)
      : counts_(num_items),
        threads_(num_items, num_threads, group_size,
                 [this](const std::uint32_t* items, std::size_t count) { work(items, count); }) {}

  void start(const std::vector<std::uint32_t>& items) {
    for (const std::uint32_t item : items) threads_.add(item);
    threads_.start(items.size());
  }
  std::vector<std::uint32_t> collect(std::size_t count) {
    std::vector<std::uint32_t> items(count);
    threads_.collect(count, items.data());
    return items;
  }
  const std::vector<int>& counts() const { return counts_; }
  std::function<void(std::uint32_t)> wait_for = [](std::uint32_t) {};

 private:
  void work(const std::uint32_t* items, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      wait_for(items[i]);
      ++counts_[items[i]];
    }
  }

  std::vector<int> counts_;
  ThreadPool threads_;
};

std::vector<std::uint32_t> first_numbers(std::size_t count) {
  std::vector<std::uint32_t> numbers(count);
  std::iota(numbers.begin(), numbers.end(), 0);
  return numbers;
}

TEST(ThreadPool, ProcessesEachItemOncePerRound) {
  constexpr int kRounds = 2000;
  for (const std::size_t num_threads : {1, 2, 3, 7}) {
    for (const std::size_t num_items : {1, 2, 10, 33}) {
      for (const std::size_t group_size : {1, 4}) {
        const std::vector<std::uint32_t> all = first_numbers(num_items);
        Counters counters(num_items, num_threads, group_size);
        for (int round = 0; round < kRounds; ++round) {
          counters.start(all);
          std::vector<std::uint32_t> items = counters.collect(num_items);
          std::sort(items.begin(), items.end());
          ASSERT_EQ(items, all);
        }
        ASSERT_EQ(counters.counts(), std::vector<int>(num_items, kRounds));
      }
    }
  }
}

TEST(ThreadPool, CollectsItemsInAnyOrder) {
  constexpr std::size_t kItems = 5;
  constexpr int kRounds = 20000;
  Counters counters(kItems, 3);
  std::vector<int> expected(kItems);
  counters.start(first_numbers(kItems));
  for (int& count : expected) ++count;
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<std::uint32_t> items = counters.collect(2);
    for (const std::uint32_t item : items) ASSERT_EQ(counters.counts()[item], expected[item]++);
    counters.start(items);
  }
  counters.collect(kItems);
  EXPECT_EQ(counters.counts(), expected);
}

TEST(ThreadPool, CollectsInTheOrderOfCompletion) {
  Counters counters(3, 2);
  std::atomic<bool> has_begun{false};
  std::atomic<bool> may_end{false};
  counters.wait_for = [&](std::uint32_t item) {
    if (item != 2) return;
    has_begun = true;
    while (!may_end) std::this_thread::yield();
  };
  counters.start({2});
  while (!has_begun) std::this_thread::yield();  // item 2 runs in the other thread
  counters.start({0, 1});
  EXPECT_EQ(counters.collect(1)[0], 0U);
  EXPECT_EQ(counters.collect(1)[0], 1U) << "stolen";
  may_end = true;
  EXPECT_EQ(counters.collect(1)[0], 2U);
}

}  // namespace
}  // namespace walker
