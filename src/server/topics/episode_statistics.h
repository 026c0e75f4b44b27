// Counters of a server and statistics of its latest episodes. No ROS.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

#include "episode/episode.h"

namespace walker {

/// Counts since the start, over all environments.
struct ServerCounters {
  std::uint64_t steps = 0;
  std::uint64_t resets = 0;    ///< including restores
  std::uint64_t advances = 0;  ///< of simulation time, by one dt each
  std::uint64_t simulation_errors = 0;
  std::uint64_t refused_commands = 0;    ///< invalid effort commands, and all in lock-step
  std::uint64_t contested_commands = 0;  ///< effort commands that replaced another agent's
  std::uint64_t contested_steps = 0;     ///< calls that stepped in turns with another agent's
  std::uint64_t clamped_commands = 0;    ///< actions and efforts out of bounds
  std::uint64_t command_timeouts = 0;
  std::uint64_t missed_deadlines = 0;
};

/// Statistics of the last 100 episodes that ended. Episodes cut short by a reset are left out: they
/// say nothing about the walker.
class EpisodeStatistics {
 public:
  static constexpr std::size_t kCapacity = 100;

  /// All values are 0 if there are no episodes.
  struct Summary {
    std::size_t episodes = 0;  ///< at most `kCapacity`
    double return_mean = 0;
    double return_deviation = 0;  ///< population standard deviation, as NumPy's std
    double return_min = 0;
    double return_max = 0;
    double length_mean = 0;  ///< [steps]
    // Each episode counts in one of these.
    std::size_t terminated = 0;  ///< also if the same step reached the time limit
    std::size_t truncated = 0;
    std::size_t failed = 0;  ///< ended by an engine failure
  };

  /// @param state right after its last step
  void add(const EpisodeState& state);

  Summary summary() const;

 private:
  enum class End { terminated, truncated, failed };

  // Ring buffers.
  Eigen::ArrayXd returns_ = Eigen::ArrayXd(kCapacity);
  Eigen::ArrayXd lengths_ = Eigen::ArrayXd(kCapacity);  // [steps]
  std::array<End, kCapacity> ends_{};
  std::uint64_t count_ = 0;
};

}  // namespace walker
