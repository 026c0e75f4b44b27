// Plays many episodes of many policies at once, each to its end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "walker_sim/environment.h"
#include "walker_sim/export.h"
#include "walker_sim/policy.h"
#include "walker_sim/world.h"

namespace walker {

/// An episode to play.
struct EpisodeJob {
  std::size_t policy = 0;  ///< index of its policy
  std::uint64_t seed = 0;  ///< of its reset
  std::size_t world = 0;   ///< index of its world
};

/// Outcome of an episode.
struct PlayedEpisode {
  double episode_return = 0;
  std::uint32_t length = 0;  ///< [steps]
  bool terminated = false;
  bool truncated = false;
  double reward = 0;         ///< of the last step
  std::string end_reason;    ///< as `Result::end_reason`
  std::string error;         ///< the engine's message if it failed; else empty
  std::vector<double> info;  ///< of the last step, one value per info name; NaN: absent
  World world;               ///< drawn at the reset
  /// Sums over the observations that the policy got, and over their squares; empty unless
  /// `EpisodePlayerOptions::sums_observations`.
  std::vector<double> observation_sums;
  std::vector<double> observation_squares;
};

struct EpisodePlayerOptions {
  /// Including the caller's; 0: one per available processor.
  std::size_t num_threads = 0;
  /// Environments of all threads; each thread has at least one. 0: 64 per thread.
  std::size_t num_envs = 0;
  bool sums_observations = false;
};

/// Plays episodes with several threads, including the caller's. A thread that has finished an
/// episode begins the next one, so that none waits for the longest. An episode depends on its own
/// job only: the outcome has the same bits with any number of threads and environments, and in any
/// company. Not thread-safe.
class WALKER_SIM_EXPORT EpisodePlayer {
 public:
  /// Receives the outcome of a job, by its index, in the calling thread.
  using Receive = std::function<void(std::size_t job, const PlayedEpisode& episode)>;

  /// @param make called for each environment, as they are needed, in the caller's thread; must
  ///             create equal environments
  /// @throws std::invalid_argument naming the invalid option, its value and the allowed values, or
  ///         if an environment's episodes depend on earlier ones
  explicit EpisodePlayer(std::function<std::unique_ptr<Environment>()> make,
                         const EpisodePlayerOptions& options = {});
  EpisodePlayer(const EpisodePlayer&) = delete;
  EpisodePlayer& operator=(const EpisodePlayer&) = delete;
  ~EpisodePlayer();

  const Specification& specification() const;
  /// The options with defaults filled in: no number is 0.
  const EpisodePlayerOptions& options() const;

  /// Checks policies and worlds, then plays every job. What `receive` throws ends the call, as do
  /// these:
  /// @param worlds  empty: Gymnasium's world for every job
  /// @param receive called for each job once, in the order in which the episodes end
  /// @throws std::invalid_argument naming the job whose policy or world does not exist, PolicyError
  ///         if a policy does not fit the environment or its action is not finite
  void play(const std::vector<const Policy*>& policies, const std::vector<World>& worlds,
            const std::vector<EpisodeJob>& jobs, const Receive& receive);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace walker
