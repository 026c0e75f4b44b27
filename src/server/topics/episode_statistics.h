// What a server counts, and how the latest episodes went. No ROS.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

#include "episode/episode.h"

namespace walker {

/// Since the start, of all environments.
struct ServerCounters {
  std::uint64_t steps = 0;
  std::uint64_t resets = 0;    ///< restores too
  std::uint64_t advances = 0;  ///< of simulation time, by one dt each
  std::uint64_t simulation_errors = 0;
  std::uint64_t refused_commands = 0;    ///< effort commands with an error, or in lock-step
  std::uint64_t contested_commands = 0;  ///< effort commands in place of another agent's
  std::uint64_t contested_steps = 0;     ///< calls that stepped amid another agent's
  std::uint64_t clamped_commands = 0;    ///< actions and efforts beyond the bounds
  std::uint64_t command_timeouts = 0;
  std::uint64_t missed_deadlines = 0;
};

/// Of the last 100 episodes that came to an end. One that a reset cut short tells nothing of the
/// walker and is left out.
class EpisodeStatistics {
 public:
  static constexpr std::size_t kCapacity = 100;

  /// The numbers below `episodes` are 0 without any.
  struct Summary {
    std::size_t episodes = 0;  ///< at most `kCapacity`
    double return_mean = 0;
    double return_deviation = 0;  ///< standard deviation as NumPy's std: of these episodes
    double return_min = 0;
    double return_max = 0;
    double length_mean = 0;  ///< [steps]
    // Every episode counts once.
    std::size_t terminated = 0;  ///< also where the time limit came with the same step
    std::size_t truncated = 0;
    std::size_t failed = 0;  ///< the simulation had to end it
  };

  /// Takes account of an episode.
  /// @param state right after its last step
  void add(const EpisodeState& state);

  Summary summary() const;

 private:
  enum class End { terminated, truncated, failed };

  // Rings.
  Eigen::ArrayXd returns_ = Eigen::ArrayXd(kCapacity);
  Eigen::ArrayXd lengths_ = Eigen::ArrayXd(kCapacity);  // [steps]
  std::array<End, kCapacity> ends_{};
  std::uint64_t count_ = 0;
};

}  // namespace walker
