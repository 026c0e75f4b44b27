// Compares observations built from a server's topics with the server's own of the same stamp.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <map>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <ros/ros.h>

#include "agents/sensor_topics.h"
#include "as_numbers.h"
#include "episode/walker.h"
#include "server/remote.h"
#include "walker_sim/agent.h"
#include "walker_sim/registry.h"

namespace walker::test {
namespace {

/// A server of observation_topics_test.test.
struct Case {
  const char* space;  // namespace of the server and its topics
  const char* id;
  Parameters parameters;
  double stamp_tolerance;  // [s]
  double bound;            // documented in observation_builder.h
  World world = {};        // of the server
};

/// Collects measurements by stamp. Needs a spinner in another thread.
class Sensed {
 public:
  Sensed(const std::string& space, const Specification& specification, double stamp_tolerance)
      : node_(space),
        topics_(node_, specification, stamp_tolerance,
                [this](ros::Time stamp, const Measurements& measured) { add(stamp, measured); }) {}

  /// Blocks until the measurements of this stamp arrive; nullopt on timeout.
  std::optional<Measurements> at(ros::Time stamp, std::chrono::milliseconds patience = kPatience) {
    std::unique_lock<std::mutex> lock(mutex_);
    const auto is_there = [&] { return measurements_.count(stamp) != 0; };
    if (!changed_.wait_for(lock, patience, is_there)) return std::nullopt;
    return measurements_.at(stamp);
  }

 private:
  void add(ros::Time stamp, const Measurements& measurements) {
    const std::lock_guard<std::mutex> lock(mutex_);
    measurements_[stamp] = measurements;
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<ros::Time, Measurements> measurements_;
  ros::NodeHandle node_;
  SensorTopics topics_;  // last: its callbacks use the members above
};

class ObservationTopics : public testing::TestWithParam<Case> {
 protected:
  /// Resets until measurements arrive: a publisher accepts a subscriber after a short delay.
  void SetUp() override {
    twin_.environment().set_world(GetParam().world);
    const auto give_up = std::chrono::steady_clock::now() + kPatience;
    while (std::chrono::steady_clock::now() < give_up) {
      if (sensed_.at(remote_.reset(0).header.stamp, std::chrono::milliseconds(50))) return;
    }
    FAIL() << "the topics tell nothing of a reset";
  }

  walker_sim::Transition reset(std::uint64_t seed) {
    twin_.reset(seed);
    stamps_.clear();
    measured_step_.reset();
    builder_->reset();
    return remote_.reset(seed);
  }

  walker_sim::Transition step(const std::vector<double>& action) {
    twin_.step(action);
    return remote_.step(action);
  }

  /// Compares with the measurements of the step that the walker observes, which a world may delay.
  void compare(const walker_sim::Transition& told) {
    ASSERT_TRUE(twin_.equals(told));
    stamps_.push_back(told.header.stamp);
    const std::uint32_t step = walker_of(twin_.environment()).observed_step();
    if (measured_step_ != step) {
      const std::optional<Measurements> measurements = sensed_.at(stamps_.at(step));
      ASSERT_TRUE(measurements) << "the topics tell nothing of step " << step;
      builder_->build(*measurements, built_.data());
      measured_step_ = step;
    }
    for (std::size_t i = 0; i < built_.size(); ++i) {
      ASSERT_NEAR(built_[i], told.observation[i], GetParam().bound)
          << "value " << i << " of step " << told.step << ", episode " << told.episode;
    }
    ++compared_;
  }

  Twin twin_{GetParam().id, GetParam().parameters};
  const Specification& specification_ = twin_.environment().specification();
  std::unique_ptr<ObservationBuilder> builder_ =
      make_observation_builder(GetParam().id, GetParam().parameters);
  Remote remote_{GetParam().space + std::string("/walker_sim")};
  Sensed sensed_{GetParam().space, specification_, GetParam().stamp_tolerance};
  std::vector<ros::Time> stamps_;               // of the episode's steps
  std::optional<std::uint32_t> measured_step_;  // of `built_`
  std::vector<double> built_ = std::vector<double>(specification_.observation_size());
  int compared_ = 0;
};

TEST_P(ObservationTopics, EqualTheServersOwn) {
  for (const char* name : {"heuristic", "random"}) {
    const std::unique_ptr<Agent> agent = make_agent(name, specification_, 1);
    for (const std::uint64_t seed : {3, 6, 9}) {
      walker_sim::Transition told = reset(seed);
      agent->reset();
      ASSERT_NO_FATAL_FAILURE(compare(told));
      for (int i = 0; i < 150 && !told.terminated && !told.truncated; ++i) {
        told = step(agent->act(told.observation));
        ASSERT_NO_FATAL_FAILURE(compare(told));
      }
    }
  }
  EXPECT_GT(compared_, 400);
}

constexpr double kSingle = 1.2e-7;
constexpr double kDouble = 1e-12;

// As in the launch file.
const World kNoise = as_numbers({{"joint_position_noise", 0.05},
                                 {"joint_velocity_noise", 0.5},
                                 {"orientation_noise", 0.1},
                                 {"angular_velocity_noise", 0.3},
                                 {"linear_velocity_noise", 0.2}});
const World kLate = as_numbers({{"observation_delay", 0.1}, {"dropout", 0.3}});
const World kLateAndNoisy =
    as_numbers({{"joint_position_noise", 0.05}, {"observation_delay", 0.04}});

/// kNoise, and noisy ranges of a lidar that sees less far.
World with_lidar() {
  World world = kNoise;
  world.merge(as_numbers({{"lidar_range", 4}, {"range_noise", 0.5}}));
  return world;
}

const Parameters kUnlimited{{"terminate_when_unhealthy", false}};
const Parameters kLidar{{"include_lidar_in_observation", true}};

INSTANTIATE_TEST_SUITE_P(
    Servers, ObservationTopics,
    testing::Values(Case{"/plain", "BipedalWalker-v3", {}, 0, kSingle},
                    Case{"/hardcore", "BipedalWalkerHardcore-v3", {}, 0, kSingle},
                    Case{"/v4", "Walker2d-v4", kUnlimited, 0, kDouble},
                    Case{"/v5", "Walker2d-v5", {}, 0, kDouble},
                    // With equal stamps, a tolerance has no effect.
                    Case{"/plain", "BipedalWalker-v3", {}, 0.005, kSingle},
                    Case{"/v5", "Walker2d-v5", {}, 0.003, kDouble},
                    Case{"/noisy", "BipedalWalker-v3", {}, 0, kSingle, with_lidar()},
                    Case{"/noisy_v5", "Walker2d-v5", {}, 0, kDouble, kNoise},
                    Case{"/noisy_hopper", "Hopper-v5", kLidar, 0, kSingle, with_lidar()},
                    Case{"/lidar", "Walker2d-v4", kLidar, 0, kSingle},
                    Case{"/late", "BipedalWalker-v3", {}, 0, kSingle, kLate},
                    Case{"/late_v5", "Walker2d-v5", kUnlimited, 0, kDouble, kLateAndNoisy}),
    [](const testing::TestParamInfo<Case>& of) {
      return std::string(of.param.space).substr(1) +
             (of.param.stamp_tolerance == 0 ? "" : "_with_tolerance");
    });

}  // namespace
}  // namespace walker::test
