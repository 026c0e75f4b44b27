// A pool passes groups of environments to types that step several at once.
#include <gtest/gtest.h>

#include <memory>
#include <numeric>
#include <vector>

#include "episode/fake_robot.h"
#include "episode/rollout.h"

namespace walker {
namespace {

using Values = std::vector<double>;

class TogetherRobot : public FakeRobot {
 public:
  void step_group(RobotStep* const* group, std::size_t count) noexcept override {
    counts->push_back(count);
    FakeRobot::step_group(group, count);
  }
  void step(RobotStep& step) override {
    FakeRobot::step(step);
    step.reward += 1000;
  }
  std::size_t group_size() const override { return 3; }

  std::vector<std::size_t>* counts = nullptr;
};

class TogetherTest : public testing::Test {
 protected:
  static constexpr std::size_t kEnvironments = 7;

  TogetherTest() {
    const PoolOptions options{kEnvironments, 1, AutoresetMode::next_step, 5};
    pool_ = std::make_unique<Pool>(fakes_, options);
    arrays_ = std::make_unique<PoolArrays>(pool_->specification(), kEnvironments);
    for (TogetherRobot* robot : *fakes_.all) robot->counts = &counts_;
    pool_->reset({}, {}, arrays_->batch());
  }
  void step() {
    counts_.clear();
    Values actions(kEnvironments * 2);
    std::iota(actions.begin(), actions.end(), 0);
    pool_->step(actions.data(), actions.size(), arrays_->batch());
  }

  Fakes<TogetherRobot> fakes_;
  std::vector<std::size_t> counts_;
  std::unique_ptr<Pool> pool_;
  std::unique_ptr<PoolArrays> arrays_;
};

TEST_F(TogetherTest, StepsInGroupsOfItsSize) {
  step();
  EXPECT_EQ(counts_, (std::vector<std::size_t>{3, 3, 1}));
  EXPECT_EQ(arrays_->rewards, (Values{1001, 1005, 1009, 1013, 1017, 1021, 1025}));
}

TEST_F(TogetherTest, ResetsEnvironmentsInTheirGroup) {
  fakes_[1].length = 1;
  step();
  step();
  EXPECT_EQ(counts_, (std::vector<std::size_t>{3, 3, 1}));
  EXPECT_EQ(arrays_->rewards[1], 0);
  EXPECT_EQ(arrays_->episodes[1], 2U);
}

TEST_F(TogetherTest, AFailureLeavesTheOthersAlone) {
  fakes_[4].step_fails = true;
  step();
  EXPECT_STREQ(pool_->error(4), "the engine gave up");
  EXPECT_EQ(arrays_->rewards, (Values{1001, 1005, 1009, 1013, 0, 1021, 1025}));
}

TEST_F(TogetherTest, GroupsSentEnvironments) {
  const Values actions(6);
  const std::vector<std::uint32_t> first{6, 2};
  const std::vector<std::uint32_t> then{0, 1, 5};
  counts_.clear();
  pool_->send(actions.data(), first.data(), 2);
  pool_->send(actions.data(), then.data(), 3);
  EXPECT_TRUE(counts_.empty()) << "one thread works in recv only";
  std::vector<std::uint32_t> arrived(5);
  pool_->recv(arrays_->batch(), arrived.data());
  EXPECT_EQ(arrived, (std::vector<std::uint32_t>{6, 2, 0, 1, 5}));
  EXPECT_EQ(counts_, (std::vector<std::size_t>{3, 2}));
}

}  // namespace
}  // namespace walker
