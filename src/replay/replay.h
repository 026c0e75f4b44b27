// Repeats recorded episodes and compares them to the bit. Knows no bag: fed with messages.
#pragma once

#include <string>
#include <vector>

#include "episode/episode.h"
#include "walker_sim/EnvironmentSpec.h"
#include "walker_sim/Episode.h"
#include "walker_sim/Transition.h"

namespace walker {

/// An environment as the recorded one, which repeats one episode after another.
class Replay {
 public:
  /// @throws std::invalid_argument naming what keeps an environment here from being as the recorded
  ///         one: id, parameters, model; or that its episodes depend on those before them
  explicit Replay(const walker_sim::EnvironmentSpec& spec);

  /// What of engine and versions was another when it was recorded; empty: nothing.
  const std::string& other_versions() const { return other_versions_; }

  /// Begins an episode and repeats what a restored one began with.
  /// @param beginning as published at the reset
  /// @param actions   of the record that was restored, step x action; empty: none was
  void begin(const walker_sim::Episode& beginning, const std::vector<double>& actions = {});

  /// Compares the episode's next state; the first after `begin` is the one that the episode began
  /// with. Observation, reward, return, flags, info and error are compared, NaN by its bits. After
  /// a difference nothing is done any more.
  void compare(const walker_sim::Transition& recorded);

  /// Compares what was published at the episode's end: length, return, reason.
  void compare_end(const walker_sim::Episode& recorded);

  /// The first difference of the present episode, e.g. "at step 3: reward is 0.1, repeated 0.2";
  /// empty: none.
  const std::string& difference() const { return difference_; }

 private:
  void step(const std::vector<double>& action);

  std::unique_ptr<Episode> episode_;
  std::string other_versions_;
  std::string difference_;
  bool is_at_beginning_ = false;
};

}  // namespace walker
