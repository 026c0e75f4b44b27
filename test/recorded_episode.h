// Parses and replays recorded episodes of any robot.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "recording.h"
#include "stepper.h"

namespace walker {

struct Headline {
  explicit Headline(Recording& recording)
      : kind(recording.next<std::string>()),
        seed(recording.next<std::string>()),
        action_seed(recording.next<std::uint64_t>()),
        steps(recording.next<std::size_t>()) {}

  std::optional<std::uint64_t> reset_seed() const {
    if (seed == "-") return std::nullopt;
    return std::stoull(seed);
  }

  std::string kind;
  std::string seed;
  std::uint64_t action_seed;
  std::size_t steps;
};

/// Returns the low 32 bits of a row's hash, which recordings store per row.
inline std::uint64_t short_hash(const std::vector<double>& row) {
  Hash hash;
  for (const double value : row) hash.add(value);
  return hash.value() & 0xFFFFFFFFU;
}

template <typename Actions>
Actions make_actions(const Headline& episode, [[maybe_unused]] int size) {
  if constexpr (std::is_constructible_v<Actions, std::string, std::uint64_t, int>) {
    return Actions(episode.kind, episode.action_seed, size);
  } else {
    return Actions(episode.kind, episode.action_seed);
  }
}

/// Replays a recorded episode. Calls `compare(i, action)` after the reset (i = 0, zero action) and
/// after each step, until a call fails fatally.
template <typename Actions, typename Compare>
void replay(const Headline& episode, Stepper& walker, Compare compare) {
  std::vector<double> action(walker.environment->specification().action_size(), 0);
  auto actions = make_actions<Actions>(episode, static_cast<int>(action.size()));
  for (std::size_t i = 0; i <= episode.steps; ++i) {
    if (i == 0) {
      walker.reset(episode.reset_seed());
    } else {
      actions.draw(walker.observation, action);
      walker.step(action);
    }
    compare(i, action);
    if (testing::Test::HasFatalFailure()) return;
  }
}

}  // namespace walker
