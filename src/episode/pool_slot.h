// An environment of a pool, as the pool's caller sees it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "base/limits.h"
#include "episode/episode.h"
#include "walker_sim/pool.h"

namespace walker {

/// An episode, and what autoreset needs beside it. Aligned, for neighbours may be in the hands of
/// different threads.
class alignas(kCacheLine) PoolSlot {
 public:
  /// @param mode same_step keeps the last state of an episode that it follows with the next
  PoolSlot(std::unique_ptr<Environment> environment, std::uint32_t index, AutoresetMode mode);

  Episode& episode() const { return *episode_; }
  /// The state after the last step or reset: in same_step possibly of the episode that it ended.
  const EpisodeState& outcome() const { return has_final_ ? final_ : episode_->state(); }
  /// Whether the last call ended an episode, whose last state is `outcome`, and began the next.
  bool has_final() const { return has_final_; }

  void request_reset() { wants_reset_ = true; }
  /// Whether the next step is a reset instead.
  bool is_reset_by_step() const { return wants_reset_ || episode_->state().has_ended(); }

  void reset(std::optional<std::uint64_t> seed);
  void begin_step() { has_final_ = false; }
  /// After the step: in same_step begins the next episode.
  void finish_step();

  /// Writes what the last reset or step gave into a row of the caller's arrays.
  void write(const Batch& batch, std::size_t row) const;

  /// An episode was loaded from a saved state.
  void forget_final() { has_final_ = false; }

 private:
  void keep_final();

  std::unique_ptr<Episode> episode_;
  bool is_same_step_;
  bool wants_reset_ = false;
  bool has_final_ = false;
  EpisodeState final_;
};

}  // namespace walker
