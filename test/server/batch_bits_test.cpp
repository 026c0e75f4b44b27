// A batch stepped over ROS is bitwise equal to in-process environments, in every autoreset mode.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <ros/ros.h>

#include "server/remote.h"
#include "server/twin.h"
#include "walker_sim/ResetBatch.h"
#include "walker_sim/StepBatch.h"

namespace walker::test {
namespace {

constexpr std::size_t kSize = 8;
constexpr std::uint64_t kSeed = 40;  // as in batch_bits_test.test

/// Client of one server, with an in-process twin of each of its environments.
class BatchClient {
 public:
  BatchClient(const std::string& server, const std::string& id, std::string autoreset_mode)
      : autoreset_mode_(std::move(autoreset_mode)) {
    for (std::size_t i = 0; i < kSize; ++i) {
      twins_.push_back(std::make_unique<Twin>(id));
      lengths_.push_back(0);
      episodes_.push_back(0);
    }
    const std::string name = server + "/walker_sim/";
    EXPECT_TRUE(ros::service::waitForService(name + "unpause", ros::Duration(kPatience.count())));
    reset_ = node_.serviceClient<walker_sim::ResetBatch>(name + "reset_batch", true);
    step_ = node_.serviceClient<walker_sim::StepBatch>(name + "step_batch", true);
  }

  /// @param seeds empty, or one per environment
  void reset(const std::vector<std::uint32_t>& environments,
             const std::vector<std::optional<std::uint64_t>>& seeds) {
    walker_sim::ResetBatch call;
    call.request.environments = environments;
    for (const auto& seed : seeds) {
      call.request.has_seed.push_back(seed.has_value() ? 1 : 0);
      call.request.seeds.push_back(seed.value_or(0));
    }
    ASSERT_TRUE(reset_.call(call));
    ASSERT_TRUE(call.response.success) << call.response.status_message;
    const std::size_t count = environments.empty() ? kSize : environments.size();
    for (std::size_t row = 0; row < count; ++row) {
      const std::size_t i = environments.empty() ? row : environments[row];
      reset_twin(i, seeds.empty() ? std::nullopt : seeds[row]);
      const walker_sim::Transition row_state =
          transition(i, call.response.observations, call.response.info, row);
      EXPECT_TRUE(twins_[i]->equals(row_state)) << "environment " << i;
    }
  }

  void step() {
    walker_sim::StepBatch call;
    const std::size_t width = twins_[0]->environment().specification().action_size();
    for (std::size_t i = 0; i < kSize * width; ++i) {
      call.request.actions.push_back(double{static_cast<float>(uniform_(draws_))});
    }
    ASSERT_TRUE(step_.call(call));
    ASSERT_TRUE(call.response.success) << call.response.status_message;
    num_final_ = 0;
    for (std::size_t i = 0; i < kSize; ++i) {
      const auto action = call.request.actions.begin() + static_cast<std::ptrdiff_t>(i * width);
      compare_row(i, {action, action + static_cast<std::ptrdiff_t>(width)}, call.response);
    }
    EXPECT_EQ(call.response.final_environments.size(), num_final_);
  }

  std::vector<std::uint32_t> ended() const {
    std::vector<std::uint32_t> indices;
    for (std::uint32_t i = 0; i < kSize; ++i) {
      if (twins_[i]->has_ended()) indices.push_back(i);
    }
    return indices;
  }

  std::uint32_t num_episodes() const {
    std::uint32_t count = 0;
    for (const std::uint32_t episodes : episodes_) count += episodes;
    return count;
  }

 private:
  void reset_twin(std::size_t i, std::optional<std::uint64_t> seed) {
    if (episodes_[i] == 0 && !seed) seed = kSeed + i;
    twins_[i]->reset(seed);
    lengths_[i] = 0;
    ++episodes_[i];
  }

  void compare_row(std::size_t i, const std::vector<double>& action,
                   const walker_sim::StepBatch::Response& response) {
    Twin& twin = *twins_[i];
    SCOPED_TRACE("environment " + std::to_string(i));
    const bool needs_reset = twin.has_ended();
    if (needs_reset) {
      EXPECT_EQ(autoreset_mode_, "next_step");
      reset_twin(i, std::nullopt);
    } else {
      twin.step(action);
      ++lengths_[i];
    }
    walker_sim::Transition row = transition(i, response.observations, response.info, i);
    row.reward = response.rewards[i];
    row.terminated = response.terminated[i];
    row.truncated = response.truncated[i];
    if (twin.has_ended() && autoreset_mode_ == "same_step") {
      ASSERT_LT(num_final_, response.final_environments.size());
      EXPECT_EQ(response.final_environments[num_final_], i);
      const walker_sim::Transition last =
          transition(i, response.final_observations, response.final_info, num_final_++);
      row.observation = last.observation;
      row.info = last.info;
      EXPECT_TRUE(twin.equals(row));
      reset_twin(i, std::nullopt);
      row = transition(i, response.observations, response.info, i);
    }
    EXPECT_TRUE(twin.equals(row));
    EXPECT_EQ(response.episodes[i], episodes_[i]);
    EXPECT_EQ(response.steps[i], lengths_[i]);
  }

  /// Converts a row to the message that the twin compares. Rows contain neither return nor error:
  /// the return is the twin's, the error is empty.
  walker_sim::Transition transition(std::size_t i, const std::vector<double>& observations,
                                    const std::vector<double>& info, std::size_t row) const {
    const Specification& specification = twins_[i]->environment().specification();
    const auto cut = [row](const std::vector<double>& rows, std::size_t width) {
      if (rows.size() < (row + 1) * width) return std::vector<double>();
      const auto begin = rows.begin() + static_cast<std::ptrdiff_t>(row * width);
      return std::vector<double>(begin, begin + static_cast<std::ptrdiff_t>(width));
    };
    walker_sim::Transition message;
    message.observation = cut(observations, specification.observation_size());
    message.info = cut(info, specification.info_names.size());
    message.step = lengths_[i];
    message.episode_return = twins_[i]->episode_return();
    return message;
  }

  std::string autoreset_mode_;
  ros::NodeHandle node_;
  ros::ServiceClient reset_;
  ros::ServiceClient step_;
  std::vector<std::unique_ptr<Twin>> twins_;
  std::vector<std::uint32_t> lengths_;
  std::vector<std::uint32_t> episodes_;
  std::size_t num_final_ = 0;
  std::mt19937 draws_{7};
  std::uniform_real_distribution<double> uniform_{-1, 1};
};

struct Case {
  const char* server;
  const char* id;
  const char* autoreset_mode;
};

class BatchBits : public testing::TestWithParam<Case> {};

TEST_P(BatchBits, EqualEnvironmentsInProcess) {
  BatchClient client(GetParam().server, GetParam().id, GetParam().autoreset_mode);
  client.reset({}, {});  // environment i takes the seed kSeed + i
  for (int i = 0; i < 1000 && !HasFailure(); ++i) {
    if (GetParam().autoreset_mode == std::string("disabled") && !client.ended().empty()) {
      client.reset(client.ended(), {});
    }
    if (i == 30) client.reset({6, 1}, {std::nullopt, 12});
    client.step();
  }
  EXPECT_GT(client.num_episodes(), 2 * kSize) << "too few episodes ended";
  client.reset({}, std::vector<std::optional<std::uint64_t>>(kSize, 3));
  for (int i = 0; i < 50 && !HasFailure() && client.ended().empty(); ++i) client.step();
}

INSTANTIATE_TEST_SUITE_P(
    Servers, BatchBits,
    testing::Values(Case{"/bipedal_walker/next_step", "BipedalWalker-v3", "next_step"},
                    Case{"/bipedal_walker/same_step", "BipedalWalker-v3", "same_step"},
                    Case{"/bipedal_walker/disabled", "BipedalWalker-v3", "disabled"},
                    Case{"/walker2d/next_step", "Walker2d-v5", "next_step"},
                    Case{"/walker2d/same_step", "Walker2d-v5", "same_step"},
                    Case{"/walker2d/disabled", "Walker2d-v5", "disabled"}),
    [](const testing::TestParamInfo<Case>& instance) {
      return std::string(instance.param.id, instance.param.id[0] == 'B' ? 13 : 8) +
             instance.param.autoreset_mode;
    });

}  // namespace
}  // namespace walker::test
