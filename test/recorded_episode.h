// What the recordings of all walkers' episodes have in common.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "recording.h"

namespace walker {

/// One `episode` line of a recording.
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

/// A row as recordings hold it: the low 32 bits of its hash.
inline std::uint64_t short_hash(const std::vector<double>& row) {
  Hash hash;
  for (const double value : row) hash.add(value);
  return hash.value() & 0xFFFFFFFFU;
}

}  // namespace walker
