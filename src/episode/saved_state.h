// Saved states of an episode. A header identifies the environment and protects the integrity:
//
//   magic, format version, size and checksum of all that follows, origin, then the episode (phase,
//   last outcome), its generator, its worlds (of the resets to come; as drawn, with the
//   disturbances' state) and the robot's state
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/state_bytes.h"
#include "walker_sim/specification.h"

namespace walker {

/// Format version. Increment it if the order or the meaning of any field changes.
constexpr std::uint32_t kStateFormat = 4;

/// Identity of the environment that saved a state: id, engine, engine release and all parameters
/// except `max_episode_steps`, which does not affect the state.
class StateOrigin {
 public:
  explicit StateOrigin(const Specification& specification);

  /// Appends a header to `state`. @return its offset, for `seal`
  std::size_t begin(std::vector<std::byte>& state) const;

  /// Completes the header once the state is appended.
  static void seal(std::vector<std::byte>& state, std::size_t begin);

  /// Checks the header.
  /// @return a reader at the state that follows the header
  /// @throws std::invalid_argument if the bytes are not a state, have another format or origin, or
  ///         are damaged; naming what differs, with both values
  StateReader open(const std::byte* state, std::size_t size) const;

 private:
  [[noreturn]] void throw_difference(StateReader reader) const;

  std::vector<std::byte> text_;  // names and values
};

}  // namespace walker
