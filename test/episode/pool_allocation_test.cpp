// A pool's step allocates nothing in any of its threads.
#include <gtest/gtest.h>

#include "allocation_counter.h"
#include "episode/rollout.h"

namespace walker {
namespace {

constexpr std::size_t kCount = 5;

class PoolAllocationTest : public AllocationTest {
 protected:
  /// Walker2d's resets do not allocate either, so episodes may end.
  void make_pool(AutoresetMode mode) {
    const PoolOptions options{kCount, 3, mode, 2};
    rollout_ = std::make_unique<Rollout>("Walker2d-v5", options);
    rollout_->reset(1);
    pool_ = &rollout_->pool;
    batch_ = rollout_->arrays.batch();
    actions_.assign(kCount * pool_->specification().action_size(), 0.7);
  }

  std::unique_ptr<Rollout> rollout_;
  Pool* pool_ = nullptr;
  Batch batch_;
  std::vector<double> actions_;
};

TEST_F(PoolAllocationTest, StepsAndResetsWithoutTheHeap) {
  for (const AutoresetMode mode : {AutoresetMode::next_step, AutoresetMode::same_step}) {
    make_pool(mode);
    int calls = 0;
    const auto count = [&] { ++calls; };
    const std::function<void()> on_stepped = std::cref(count);
    const Counting counting;
    for (int i = 0; i < 500; ++i) {
      pool_->step(actions_.data(), actions_.size(), batch_);
      pool_->step(actions_.data(), actions_.size(), batch_, on_stepped);
    }
    EXPECT_GT(batch_.episodes[0], 1U);
    EXPECT_EQ(calls, 500);
  }
  EXPECT_EQ(allocations, 0);
}

TEST_F(PoolAllocationTest, StepsSomeWithoutTheHeap) {
  make_pool(AutoresetMode::next_step);
  const std::vector<std::uint32_t> environments{3, 1};
  pool_->step(actions_.data(), environments.data(), 2, batch_);  // the first call allocates
  const Counting counting;
  for (int i = 0; i < 500; ++i) pool_->step(actions_.data(), environments.data(), 2, batch_);
  EXPECT_GT(batch_.episodes[0], 1U);
  EXPECT_EQ(allocations, 0);
}

TEST_F(PoolAllocationTest, SendsAndReceivesWithoutTheHeap) {
  make_pool(AutoresetMode::next_step);
  std::vector<std::uint32_t> environments{0, 1, 2, 3, 4};
  pool_->send(actions_.data(), environments.data(), 4);  // the first call allocates
  const Counting counting;
  std::uint32_t rest = 4;
  for (int i = 0; i < 500; ++i) {
    pool_->recv(batch_, environments.data());
    std::swap(rest, environments[0]);
    pool_->send(actions_.data(), environments.data(), 2);
  }
  EXPECT_EQ(allocations, 0);
}

}  // namespace
}  // namespace walker
