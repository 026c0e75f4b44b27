// Index of the walkers and episodes in bags, with the gaps of the recording.
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

/// A recorded episode without its transitions, which remain in the bag.
struct BagEpisode {
  enum class Successor { none, reset, other_server };

  std::uint32_t number = 0;
  std::shared_ptr<const walker_sim::EnvironmentSpec> spec;    ///< null: not in the bag
  std::optional<walker_sim::Episode> beginning;               ///< as published at the reset
  std::shared_ptr<const walker_sim::EpisodeRecord> restored;  ///< record that ~restore repeated
  std::optional<walker_sim::Episode> end;
  std::uint32_t first_step = 0;
  ros::Time first_stamp;                  ///< of `first_step`
  std::uint32_t last_step = 0;            ///< last step before the first gap
  ros::Time last_stamp;                   ///< of `last_step`
  std::uint32_t first_gap_end = 0;        ///< last step of the first gap; 0: no gap
  std::size_t num_transitions = 0;        ///< in the bag, including those after a gap
  double episode_return = 0;              ///< at `last_step`
  bool terminated = false;                ///< at `last_step`
  bool truncated = false;                 ///< at `last_step`
  bool opens_recording = false;           ///< first recorded episode of its server
  std::uint32_t missing_before = 0;       ///< number of whole episodes missing before this one
  Successor successor = Successor::none;  ///< what follows in the bag

  /// Number of transitions before the first gap.
  std::size_t num_consecutive() const { return std::size_t{last_step} - first_step + 1; }
};

/// What one node published on a topic of type walker_sim/Transition and, in the same namespace, on
/// `spec`, `episode` and `restored`.
struct BagWalker {
  std::string topic;                 ///< as passed to the recorder, possibly relative
  std::string node;                  ///< publisher; empty: not recorded
  std::vector<BagEpisode> episodes;  ///< in the order of recording
};

/// Reads bags that belong together: the parts of one recording, or recordings of several walkers.
class BagEpisodes {
 public:
  /// @throws std::runtime_error naming a file that cannot be read, the cause and a remedy
  explicit BagEpisodes(const std::vector<std::string>& paths);

  const std::vector<BagWalker>& walkers() const { return walkers_; }

  /// Calls `visit` with each of the walker's transitions, in the order of recording.
  /// @throws std::runtime_error as the constructor
  void read_transitions(const BagWalker& walker,
                        const std::function<void(const walker_sim::Transition&)>& visit) const;

 private:
  struct File {
    std::string path;
    ros::Time begin;  // of the first message
    std::unique_ptr<rosbag::Bag> bag;
  };

  std::vector<BagEpisode> index(const BagWalker& walker) const;

  std::vector<File> files_;  // sorted by `begin`
  std::vector<BagWalker> walkers_;
};

}  // namespace walker
