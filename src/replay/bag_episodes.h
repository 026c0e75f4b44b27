// Episodes in bags: which walkers, which episodes, and what of them the bags lack.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <ros/time.h>
#include <rosbag/bag.h>

#include "walker_sim/EnvironmentSpec.h"
#include "walker_sim/Episode.h"
#include "walker_sim/EpisodeRecord.h"
#include "walker_sim/Transition.h"

namespace walker {

/// An episode as a bag has it; its transitions stay there.
struct BagEpisode {
  enum class Successor { none, reset, other_server };

  std::uint32_t number = 0;
  std::shared_ptr<const walker_sim::EnvironmentSpec> spec;    ///< null: not in the bag
  std::optional<walker_sim::Episode> beginning;               ///< as published with the first state
  std::shared_ptr<const walker_sim::EpisodeRecord> restored;  ///< what ~restore began it with
  std::optional<walker_sim::Episode> end;
  std::uint32_t first_step = 0;
  ros::Time first_stamp;             ///< of `first_step`
  std::uint32_t last_step = 0;       ///< up to here no step is missing
  ros::Time last_stamp;              ///< of `last_step`
  std::uint32_t gap_end = 0;         ///< last step of those missing after `last_step`; 0: none
  std::size_t num_transitions = 0;   ///< in the bag, with those after a gap
  double episode_return = 0;         ///< at `last_step`
  bool terminated = false;           ///< at `last_step`
  bool truncated = false;            ///< at `last_step`
  bool opens_recording = false;      ///< nothing of its server was recorded before
  std::uint32_t missing_before = 0;  ///< whole episodes missing between this and the one before
  Successor successor = Successor::none;  ///< what follows in the bag

  /// Transitions before anything is missing.
  std::size_t num_consecutive() const { return std::size_t{last_step} - first_step + 1; }
};

/// What one node published under a topic of type walker_sim/Transition, and beside it on `spec`,
/// `episode` and `restored`.
struct BagWalker {
  std::string topic;                 ///< as the recorder was told it, so maybe relative
  std::string node;                  ///< publisher; empty: the bag does not say
  std::vector<BagEpisode> episodes;  ///< in the order of recording
};

/// Reads bags that belong together: the parts of one recording, or recordings of several walkers.
class BagEpisodes {
 public:
  /// Finds walkers and episodes.
  /// @throws std::runtime_error naming a file that cannot be read, why, and what helps
  explicit BagEpisodes(const std::vector<std::string>& paths);

  const std::vector<BagWalker>& walkers() const { return walkers_; }

  /// Reads the walker's transitions again, in the order of its episodes, one at a time.
  /// @throws std::runtime_error as the constructor
  void read_transitions(const BagWalker& walker,
                        const std::function<void(const walker_sim::Transition&)>& visit) const;

 private:
  struct File {
    std::string path;
    ros::Time begin;  // of its first message
    std::unique_ptr<rosbag::Bag> bag;
  };

  std::vector<BagEpisode> index(const BagWalker& walker) const;

  std::vector<File> files_;  // by their beginnings
  std::vector<BagWalker> walkers_;
};

}  // namespace walker
