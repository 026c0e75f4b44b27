// Pools whose walkers a SIMD kernel steps together: results depend neither on the grouping of the
// walkers nor on the kernel.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "bits.h"
#include "kernel_variable.h"
#include "simd/instruction_sets.h"
#include "walker_sim/pool.h"

namespace walker {
namespace {

using State = std::vector<double>;

/// Instruction set of every processor of this architecture.
const char* last_set() {
  return simd::instruction_sets().empty() ? "off" : simd::instruction_sets().back().c_str();
}

class KernelPoolTest : public testing::TestWithParam<const char*> {};

struct Grouping {
  const char* kernel;
  std::size_t num_threads;
};

class Rollout {
 public:
  Rollout(const char* id, const PoolOptions& options)
      : pool_([id] { return make(id); }, options),
        observations_(options.num_envs * pool_.specification().observation_size()),
        rewards_(options.num_envs),
        terminated_(options.num_envs),
        actions_(options.num_envs * pool_.specification().action_size()) {
    batch_.observations = observations_.data();
    batch_.rewards = rewards_.data();
    batch_.terminated = terminated_.data();
    std::vector<std::optional<std::uint64_t>> seeds(options.num_envs);
    for (std::size_t i = 0; i < options.num_envs; ++i) seeds[i] = i;
    pool_.reset({}, seeds, batch_);
  }

  /// @return observations and rewards of all steps
  State play(int steps) {
    State all;
    for (int i = 0; i < steps; ++i) {
      for (double& action : actions_) action = unit_(random_);
      pool_.step(actions_.data(), actions_.size(), batch_);
      all.insert(all.end(), observations_.begin(), observations_.end());
      all.insert(all.end(), rewards_.begin(), rewards_.end());
      if (pool_.options().autoreset_mode == AutoresetMode::disabled) reset_ended();
    }
    return all;
  }

 private:
  void reset_ended() {
    std::vector<std::uint32_t> ended;
    for (std::size_t i = 0; i < terminated_.size(); ++i) {
      if (terminated_[i] != 0) ended.push_back(static_cast<std::uint32_t>(i));
    }
    if (!ended.empty()) pool_.reset(ended, {}, batch_);
  }

  Pool pool_;
  State observations_;
  State rewards_;
  std::vector<std::uint8_t> terminated_;
  State actions_;
  Batch batch_;
  std::mt19937_64 random_{9};
  std::uniform_real_distribution<double> unit_{-1, 1};
};

TEST_P(KernelPoolTest, IsTheSameForAllGroupings) {
  const auto play = [](const Grouping& grouping, std::size_t num_envs, AutoresetMode mode) {
    const KernelVariable variable(grouping.kernel);
    PoolOptions options;
    options.num_envs = num_envs;
    options.num_threads = grouping.num_threads;
    options.autoreset_mode = mode;
    return Rollout(GetParam(), options).play(100);
  };
  for (const AutoresetMode mode :
       {AutoresetMode::next_step, AutoresetMode::same_step, AutoresetMode::disabled}) {
    for (const std::size_t num_envs : {1U, 3U, 64U, 71U}) {
      const State expected = play({"off", 1}, num_envs, mode);
      for (const Grouping& grouping :
           {Grouping{last_set(), 1}, Grouping{nullptr, 1}, Grouping{nullptr, 3}}) {
        ASSERT_EQ(to_bits(play(grouping, num_envs, mode)), to_bits(expected))
            << num_envs << " environments, " << grouping.num_threads << " threads";
      }
    }
  }
}

TEST_P(KernelPoolTest, AsynchronousBatchesAreTheLibrarysEpisodes) {
  constexpr std::size_t kEnvironments = 37;
  constexpr std::size_t kBatch = 10;
  constexpr int kSteps = 80;  // minimum per environment
  const std::size_t action_size = make(GetParam())->specification().action_size();
  const auto action_of = [action_size](std::size_t environment, std::size_t step) {
    State action(action_size);
    for (std::size_t k = 0; k < action_size; ++k) {
      action[k] = std::sin(0.7 * static_cast<double>(environment * 31 + step * 7 + k * 3));
    }
    return action;
  };
  const KernelVariable variable(nullptr);
  PoolOptions options;
  options.num_envs = kEnvironments;
  options.num_threads = 2;
  options.batch_size = kBatch;
  Pool pool([] { return make(GetParam()); }, options);
  const std::size_t size = pool.specification().observation_size();
  State first(kEnvironments * size);
  Batch all;
  all.observations = first.data();
  std::vector<std::optional<std::uint64_t>> seeds(kEnvironments);
  for (std::size_t i = 0; i < kEnvironments; ++i) seeds[i] = i;
  pool.reset({}, seeds, all);

  std::vector<State> seen(kEnvironments);  // concatenated observations
  std::vector<std::size_t> num_sent(kEnvironments);
  const auto send = [&](const std::vector<std::uint32_t>& environments) {
    State actions;
    for (const std::uint32_t i : environments) {
      const State action = action_of(i, num_sent[i]++);
      actions.insert(actions.end(), action.begin(), action.end());
    }
    pool.send(actions.data(), environments.data(), environments.size());
  };
  std::vector<std::uint32_t> everyone(kEnvironments);
  std::iota(everyone.begin(), everyone.end(), 0U);
  send(everyone);
  State rows(kBatch * size);
  Batch batch;
  batch.observations = rows.data();
  std::vector<std::uint32_t> received(kBatch);
  while (*std::min_element(num_sent.begin(), num_sent.end()) < kSteps) {
    pool.recv(batch, received.data());
    for (std::size_t row = 0; row < kBatch; ++row) {
      const double* const observation = rows.data() + row * size;
      seen[received[row]].insert(seen[received[row]].end(), observation, observation + size);
    }
    send(received);
  }

  Stepper walker = make_by("off", GetParam());
  for (std::size_t i = 0; i < kEnvironments; ++i) {
    State expected;
    walker.reset(i);
    for (std::size_t step = 0; expected.size() < seen[i].size(); ++step) {
      if (walker.has_ended()) {
        walker.reset();
      } else {
        walker.step(action_of(i, step));
      }
      expected.insert(expected.end(), walker.observation.begin(), walker.observation.end());
    }
    ASSERT_EQ(to_bits(expected), to_bits(seen[i])) << "environment " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Walkers, KernelPoolTest,
                         testing::Values("BipedalWalker-v3", "BipedalWalkerHardcore-v3",
                                         "Walker2d-v5"),
                         [](const testing::TestParamInfo<const char*>& test) {
                           const std::string id = test.param;
                           return id.substr(0, id.find('-'));
                         });

}  // namespace
}  // namespace walker
