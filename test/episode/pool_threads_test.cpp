// Results are bit-identical for any number of threads, with step and with send and recv in any
// order of arrival, and for any kernel and grouping of the walkers that it steps together.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "base/random.h"
#include "episode/rollout.h"
#include "kernel_variable.h"
#include "simd/choose_kernel.h"
#include "test_name.h"

namespace walker {
namespace {

constexpr std::size_t kCount = 11;  // more than a SIMD group
constexpr std::size_t kSteps = 75;

using Case = std::tuple<std::string, AutoresetMode>;

/// Bits of each environment's results, one reset or step after another.
using History = std::vector<std::vector<std::uint64_t>>;

class Player {
 public:
  Player(const Case& chosen, std::size_t num_threads)
      // With batches of one, recv can wait for the last environment.
      : rollout_(std::get<0>(chosen), {kCount, num_threads, std::get<1>(chosen), 1},
                 {{"max_episode_steps", std::int64_t{30}}}),
        action_size_(pool_.specification().action_size()),
        actions_(kSteps * kCount * action_size_),
        history_(kCount),
        num_steps_(kCount),
        needs_reset_(kCount) {
    Generator generator(3);
    for (double& value : actions_) value = generator.uniform(-1.2, 1.2);
    rollout_.reset(50);
    for (std::uint32_t i = 0; i < kCount; ++i) keep(i, i);
  }

  History step_all() {
    for (std::size_t step = 0; step < kSteps; ++step) {
      reset_ended();
      pool_.step(action(0), kCount * action_size_, arrays_.batch());
      for (std::uint32_t i = 0; i < kCount; ++i) {
        ++num_steps_[i];
        keep(i, i);
      }
    }
    return history_;
  }

  /// Each environment gets the same actions as in step_all.
  History send_and_receive() {
    std::vector<std::uint32_t> at_rest(kCount);
    std::iota(at_rest.begin(), at_rest.end(), 0U);
    std::uint32_t arrived = 0;
    while (true) {
      if (at_rest.size() == kCount) reset_ended();
      const auto sent = std::partition(at_rest.begin(), at_rest.end(), [this](std::uint32_t i) {
        return needs_reset_[i] || num_steps_[i] == kSteps;
      });
      std::for_each(sent, at_rest.end(), [this](std::uint32_t i) {
        pool_.send(action(i), &i, 1);
        ++num_steps_[i];
      });
      at_rest.erase(sent, at_rest.end());
      if (at_rest.size() == kCount) return history_;
      pool_.recv(arrays_.batch(), &arrived);
      keep(arrived, 0);
      at_rest.push_back(arrived);
    }
  }

 private:
  /// Next action of the environment, followed by those of the environments after it.
  const double* action(std::uint32_t environment) const {
    return &actions_[(num_steps_[environment] * kCount + environment) * action_size_];
  }

  void reset_ended() {
    std::vector<std::uint32_t> ended;
    for (std::uint32_t i = 0; i < kCount; ++i) {
      if (needs_reset_[i] && num_steps_[i] != kSteps) ended.push_back(i);
    }
    if (ended.empty()) return;
    pool_.reset(ended, {}, arrays_.batch());
    for (const std::uint32_t i : ended) keep(i, i);
  }

  void keep(std::uint32_t environment, std::size_t row) {
    const std::vector<std::uint64_t> bits = to_bits(arrays_.row(row));
    history_[environment].insert(history_[environment].end(), bits.begin(), bits.end());
    const bool has_ended = arrays_.terminated[row] != 0 || arrays_.truncated[row] != 0;
    needs_reset_[environment] =
        has_ended && pool_.options().autoreset_mode == AutoresetMode::disabled;
    arrays_.forget_final(row);
  }

  Rollout rollout_;
  Pool& pool_ = rollout_.pool;
  PoolArrays& arrays_ = rollout_.arrays;
  std::size_t action_size_;
  std::vector<double> actions_;  // step x environment x action
  History history_;
  std::vector<std::size_t> num_steps_;
  std::vector<bool> needs_reset_;
};

class PoolThreadsTest : public testing::TestWithParam<Case> {};

TEST_P(PoolThreadsTest, DoNotChangeResults) {
  const History one = Player(GetParam(), 1).step_all();
  std::size_t num_words = 0;
  for (const auto& words : one) num_words += words.size();
  ASSERT_GT(num_words, kCount * (kSteps + 1) * 20);
  EXPECT_NE(one[0], one[1]) << "each has a seed of its own";
  for (const std::size_t num_threads : {1, 2, 3, 7}) {
    EXPECT_EQ(Player(GetParam(), num_threads).step_all(), one) << num_threads << " threads";
    EXPECT_EQ(Player(GetParam(), num_threads).send_and_receive(), one)
        << num_threads << " threads, as they arrive";
  }
}

INSTANTIATE_TEST_SUITE_P(EveryWalker, PoolThreadsTest,
                         testing::Combine(testing::ValuesIn(all_ids()), testing::ValuesIn(kModes)),
                         [](const testing::TestParamInfo<Case>& chosen) {
                           return test_name(std::get<0>(chosen.param)) + "_" +
                                  to_text(std::get<1>(chosen.param));
                         });

/// Instruction set of every processor of this architecture.
const char* last_set() {
  return simd::instruction_sets().empty() ? "off" : simd::instruction_sets().back().c_str();
}

struct Grouping {
  const char* kernel;
  std::size_t num_threads;
};

/// Returns the bits of all rows of 100 steps.
std::vector<std::uint64_t> play(const std::string& id, const Grouping& grouping,
                                std::size_t num_envs, AutoresetMode mode) {
  const KernelVariable variable(grouping.kernel);
  Rollout rollout(id, {num_envs, grouping.num_threads, mode, 0});
  rollout.reset(0);
  std::mt19937 random(9);
  std::vector<std::uint64_t> all;
  for (int step = 0; step < 100; ++step) {
    rollout.step(random);
    for (std::size_t i = 0; i < num_envs; ++i) {
      const std::vector<std::uint64_t> row = rollout.row(i);
      all.insert(all.end(), row.begin(), row.end());
    }
  }
  return all;
}

class KernelPoolTest : public testing::TestWithParam<const char*> {};

TEST_P(KernelPoolTest, IsTheSameForAllGroupings) {
  for (const AutoresetMode mode : kModes) {
    for (const std::size_t num_envs : {1U, 3U, 64U, 71U}) {
      const std::vector<std::uint64_t> expected = play(GetParam(), {"off", 1}, num_envs, mode);
      for (const Grouping& grouping :
           {Grouping{last_set(), 1}, Grouping{nullptr, 1}, Grouping{nullptr, 3}}) {
        ASSERT_EQ(play(GetParam(), grouping, num_envs, mode), expected)
            << num_envs << " environments, " << grouping.num_threads << " threads";
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Walkers, KernelPoolTest,
                         testing::Values("BipedalWalker-v3", "BipedalWalkerHardcore-v3",
                                         "Walker2d-v5"),
                         kNameOfId);

}  // namespace
}  // namespace walker
