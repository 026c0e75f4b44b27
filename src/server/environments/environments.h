// The environments of a server, one or many, and which of them is shown. No ROS.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "episode/episode_recorder.h"
#include "server/parameter_reader.h"
#include "walker_sim/pool.h"

namespace walker {

using MakeEnvironment = std::function<std::unique_ptr<Environment>()>;

/// The environments of a server, stepped together. Each has a recorder, which tells of its episode.
///
/// Many are in a pool. One alone is not: its episode is replaced by restores and refused a step
/// after its end, of both of which a pool that counts and resets by itself would know nothing.
class Environments {
 public:
  /// @param make makes each of them, all alike
  Environments(ServerOptions options, const MakeEnvironment& make);

  std::size_t size() const { return recorders_.size(); }
  const Specification& specification() const { return recorders_.front()->specification(); }
  EpisodeRecorder& operator[](std::size_t index) const { return *recorders_[index]; }
  EpisodeRecorder& shown() const { return *recorders_[options_.shown_environment]; }

  /// The only environment.
  /// @param service which wants it
  /// @throws std::logic_error where there are many, naming the service and what to call instead
  EpisodeRecorder& only(const std::string& service) const;

  /// @param field that has this index
  /// @throws std::invalid_argument naming the field where it is none of an environment
  void check_index(const std::string& field, std::uint32_t index) const;

  /// Begins episodes. Where an engine fails, its environment's has ended with that, and the others
  /// are as ever.
  /// @param environments which, each at most once, below `size()`
  /// @param seeds one per listed environment, or empty; where there is none the generator
  ///              continues, and a first reset takes the server's seed + the environment's index
  /// @param rows where these are written; those of others stay as they are
  void reset(const std::vector<std::uint32_t>& environments,
             const std::vector<std::optional<std::uint64_t>>& seeds, const Batch& rows = {});

  /// Steps every environment once, or resets it where the autoreset mode is next_step and its
  /// episode has ended. In the mode same_step who calls resets those whose episodes ended, so that
  /// their last state can be looked at before; where that reset failed, the next step resets.
  /// @param actions size() x action size
  /// @throws InvalidAction, ResetNeeded; then nothing has moved
  void step(const std::vector<double>& actions, const Batch& rows);

 private:
  std::unique_ptr<EpisodeRecorder> record(std::unique_ptr<Environment> environment);
  bool only_is_reset_by_step() const;
  void write_only(const Batch& rows) const;

  ServerOptions options_;
  std::vector<EpisodeRecorder*> recorders_;  // by index
  std::unique_ptr<EpisodeRecorder> only_;    // null where there are many
  std::optional<Pool> pool_;                 // of many
};

}  // namespace walker
