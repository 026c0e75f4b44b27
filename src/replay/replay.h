// Repeats recorded episodes and compares them bit by bit, without access to the bag.
#pragma once

#include <string>
#include <vector>

#include "episode/episode.h"
#include "walker_sim/EnvironmentSpec.h"
#include "walker_sim/Episode.h"
#include "walker_sim/Transition.h"

namespace walker {

/// Repeats episodes, one after another, in an environment equal to the recorded one.
class Replay {
 public:
  /// @throws std::invalid_argument if no equal environment can be made here, naming the id,
  ///         parameter or model, or if its episodes depend on earlier ones
  explicit Replay(const walker_sim::EnvironmentSpec& spec);

  /// Differences between the recording's engine, versions and libm and those here; empty if none.
  const std::string& other_versions() const { return other_versions_; }

  /// Begins an episode and, if ~restore began it, repeats the steps of its record.
  /// @param beginning as published at the reset, or as in the record
  /// @param actions   of the record, step x action; empty without a record
  void begin(const walker_sim::Episode& beginning, const std::vector<double>& actions = {});

  /// Repeats a step and compares its state; the first call after `begin` compares without a step.
  /// Compares the step's number, observation, reward, return, flags, info and error, NaN by its
  /// bits. Does nothing after a difference.
  void compare(const walker_sim::Transition& recorded);

  /// Compares the message published at the episode's end: length, return, reason.
  void compare_end(const walker_sim::Episode& recorded);

  /// Current episode's first difference, e.g. "at step 3: reward is 0.1, repeated 0.2", or empty.
  const std::string& difference() const { return difference_; }

 private:
  void step(const std::vector<double>& action);

  std::unique_ptr<Episode> episode_;
  std::string other_versions_;
  std::string difference_;
  bool is_at_beginning_ = false;
};

}  // namespace walker
