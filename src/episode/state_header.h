// What stands before a saved state: of what it is the state, and whether it is whole.
//
//   magic, format version, size and checksum of all that follows, origin, the state
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/state_bytes.h"
#include "walker_sim/specification.h"

namespace walker {

/// Another one where the order or the meaning of any field changes.
constexpr std::uint32_t kStateFormat = 2;

/// Of which environment states are: id, engine, its release and the parameters but
/// `max_episode_steps`, which says when an episode ends and nothing of the state.
class StateOrigin {
 public:
  explicit StateOrigin(const Specification& specification);

  /// Begins a state at the end of `state`. @return where, for `seal`
  std::size_t begin(std::vector<std::byte>& state) const;

  /// Once all is appended.
  static void seal(std::vector<std::byte>& state, std::size_t begin);

  /// @return at what follows the header
  /// @throws std::invalid_argument when it is no state, of another format, of another origin, or
  ///         not whole; naming what differs, with both values
  StateReader open(const std::byte* state, std::size_t size) const;

 private:
  [[noreturn]] void tell_difference(StateReader reader) const;

  std::vector<std::byte> text_;  // names and values
};

}  // namespace walker
