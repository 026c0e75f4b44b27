// Sorts what was recorded of one walker into episodes. Knows no bag: fed with messages.
#pragma once

#include <memory>
#include <vector>

#include "replay/bag_episodes.h"

namespace walker {

/// Takes a walker's messages. Each topic's are in order; those of different topics travelled apart,
/// so that one may come a little before or after its place, and are joined by their stamps.
class BagIndex {
 public:
  void add(const walker_sim::EnvironmentSpec& message);
  void add(const walker_sim::Episode& message) { announcements_.push_back(message); }
  void add(const walker_sim::EpisodeRecord& message) {
    records_.push_back(std::make_shared<walker_sim::EpisodeRecord>(message));
  }
  void add(const walker_sim::Transition& message);

  /// The episodes of all that was added; call once.
  std::vector<BagEpisode> finish();

 private:
  /// A place in `announcements_`; its size: none.
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

  // A specification belongs to a whole run of a server, wherever amid its transitions it comes.
  std::size_t run_begin_ = 0;  // index of the present run's first episode
  std::shared_ptr<const walker_sim::EnvironmentSpec> spec_;           // its; null: has not come yet
  std::shared_ptr<const walker_sim::EnvironmentSpec> repeated_spec_;  // its if no other comes
  std::shared_ptr<const walker_sim::EnvironmentSpec> next_spec_;      // came after its own
  bool spec_came_ = false;                                            // since the last transition
  std::uint32_t step_ = 0;                                            // of the last transition
};

}  // namespace walker
