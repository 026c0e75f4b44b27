// Reads the files in test/recordings.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "bits.h"
#include "stepper.h"

namespace walker {

/// Reads the words of a recording in sequence and skips its comment lines.
class Recording {
 public:
  explicit Recording(const std::string& name) {
    std::ifstream file(std::string(WALKER_SIM_RECORDINGS "/") + name);
    if (!file) throw std::runtime_error("recording " + name + ": cannot be read");
    for (std::string line; std::getline(file, line);) {
      if (line.empty() || line[0] != '#') text_ << line << '\n';
    }
  }

  bool has_more() { return static_cast<bool>(text_ >> std::ws) && !text_.eof(); }

  template <typename T>
  T next() {
    T value;
    if (!(text_ >> value)) throw std::runtime_error("recording: a word is missing or malformed");
    return value;
  }

  std::uint64_t next_hexadecimal() { return std::stoull(next<std::string>(), nullptr, 16); }

  double next_double() { return from_bits(next_hexadecimal()); }

  /// Reads a number stored as the hexadecimal bits of a float, as next_double does of a double.
  double next_float() {
    return double{from_float_bits(static_cast<std::uint32_t>(next_hexadecimal()))};
  }

 private:
  std::stringstream text_;
};

/// 64-bit FNV-1a over the bytes of doubles, as in gymnasium_reference.hashes.
class Hash {
 public:
  void add(double value) {
    std::uint64_t bits = to_bits(value);
    for (std::size_t byte = 0; byte < sizeof(bits); ++byte) {
      state_ = (state_ ^ (bits & 0xFFU)) * 0x100000001B3U;
      bits >>= 8U;
    }
  }

  std::uint64_t value() const { return state_; }

 private:
  std::uint64_t state_ = 0xCBF29CE484222325U;
};

// ---------------------------------------------------------------- recorded episodes of any robot

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
