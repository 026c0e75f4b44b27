// Groups one walker's recorded messages into episodes, without access to the bag.
#pragma once

#include <memory>
#include <vector>

#include "replay/bag_episodes.h"

namespace walker {

/// Builds episodes from a walker's messages. Each topic's messages are in order. Those of different
/// topics may be slightly out of order, since each topic has a connection; stamps match them.
class BagIndex {
 public:
  void add(const walker_sim::EnvironmentSpec& message);
  void add(const walker_sim::Episode& message) { announcements_.push_back(message); }
  void add(const walker_sim::EpisodeRecord& message) {
    records_.push_back(std::make_shared<walker_sim::EpisodeRecord>(message));
  }
  void add(const walker_sim::Transition& message);

  /// Returns the episodes of all added messages. Call once.
  std::vector<BagEpisode> finish();

 private:
  /// Index in `announcements_`; its size if there is none.
  using Place = std::size_t;

  bool goes_back(const walker_sim::Transition& message) const;
  bool is_next_server(const walker_sim::Transition& message) const;
  void end_run();
  void open(const walker_sim::Transition& message, bool begins_run);
  Place find_beginning(std::size_t index, Place from) const;
  std::shared_ptr<const walker_sim::EpisodeRecord> find_record(std::size_t index) const;
  void join_end(std::size_t index, Place from, Place to);

  std::vector<BagEpisode> episodes_;
  std::vector<walker_sim::Episode> announcements_;
  std::vector<std::shared_ptr<const walker_sim::EpisodeRecord>> records_;

  // A specification applies to a server's whole run, wherever among the transitions it arrives.
  std::size_t run_begin_ = 0;  // index of the current run's first episode
  std::shared_ptr<const walker_sim::EnvironmentSpec> spec_;           // the run's; null: none yet
  std::shared_ptr<const walker_sim::EnvironmentSpec> repeated_spec_;  // the run's if no other comes
  std::shared_ptr<const walker_sim::EnvironmentSpec> next_spec_;      // came after the run's
  bool spec_came_ = false;                                            // since the last transition
  std::uint32_t step_ = 0;                                            // of the last transition
};

}  // namespace walker
