// Episodes that can be recorded and restored, as in a server, and compared.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "bits.h"
#include "episode/walker.h"

namespace walker {

/// Compares all members to the bit, except the environment's index and the episode's number.
inline void expect_same_state(const EpisodeState& actual, const EpisodeState& expected) {
  EXPECT_EQ(actual.step, expected.step);
  EXPECT_EQ(to_bits(actual.action), to_bits(expected.action));
  EXPECT_EQ(to_bits(actual.observation), to_bits(expected.observation));
  EXPECT_EQ(to_bits(actual.info), to_bits(expected.info));
  EXPECT_EQ(to_bits(actual.reward), to_bits(expected.reward));
  EXPECT_EQ(to_bits(actual.episode_return), to_bits(expected.episode_return));
  EXPECT_EQ(actual.terminated, expected.terminated);
  EXPECT_EQ(actual.truncated, expected.truncated);
  EXPECT_EQ(actual.end_reason, expected.end_reason);
  EXPECT_EQ(actual.error, expected.error);
  EXPECT_EQ(actual.seed, expected.seed);
  EXPECT_EQ(actual.generator_state, expected.generator_state);
}

/// Replays records in a scratch episode.
class Restorable {
 public:
  Restorable(const std::function<std::unique_ptr<Environment>()>& make, std::uint64_t first_seed)
      : environment_(make()), scratch_environment_(make()) {
    WalkerOptions options;
    options.records_actions = true;
    scratch_.configure(options);
    options.first_seed = first_seed;
    walker_.configure(options);
  }

  void set_world(const World& world) { environment_->set_world(world); }
  World world() const { return walker_.world(); }
  void reset(std::optional<std::uint64_t> seed) { walker_.reset(seed); }
  void step(const std::vector<double>& action) { walker_.step(action); }
  void push(const LinkWrench& wrench) { walker_.push(wrench); }
  void set_coordinates(const std::vector<double>& position, const std::vector<double>& velocity) {
    walker_.set_coordinates(position, velocity);
  }
  const Specification& specification() const { return walker_.specification(); }
  const EpisodeState& state() const { return walker_.state(); }
  const Sensors& sensors() { return walker_.sensors(); }
  EpisodeRecord record() const { return walker_.record(); }

  void begin_restore(const EpisodeRecord& record) {
    record_ = record;
    scratch_.begin(record_);
  }
  bool go_on_restoring(std::chrono::steady_clock::time_point until) {
    return scratch_.repeat(record_, until);
  }
  void finish_restore() { walker_.take_over(scratch_); }

  void restore(const EpisodeRecord& record) {
    begin_restore(record);
    go_on_restoring(std::chrono::steady_clock::time_point::max());
    finish_restore();
  }

 private:
  std::unique_ptr<Environment> environment_;
  std::unique_ptr<Environment> scratch_environment_;
  Walker& walker_ = walker_of(*environment_);
  Walker& scratch_ = walker_of(*scratch_environment_);
  EpisodeRecord record_;
};

}  // namespace walker
