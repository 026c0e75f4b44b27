// NumPy's default random generator, to the bit.
#pragma once

#include <cstdint>

#include "walker_sim/environment.h"
#include "walker_sim/export.h"

namespace walker {

/// `numpy.random.Generator(PCG64(SeedSequence(seed)))`: the draws that the environments need.
///
/// Sources: NumPy's bit_generator.pyx (SeedSequence), pcg64.h (PCG XSL-RR 128/64 by M. O'Neill),
/// distributions.c (doubles from 53 bits; bounded integers by Lemire's method over 32-bit halves).
class WALKER_SIM_EXPORT Generator {
 public:
  /// Seeds as `default_rng(seed)` does. All 64 bits count.
  explicit Generator(std::uint64_t seed);

  /// Continues from a state that `state()` gave.
  /// @throws std::invalid_argument naming what no state has
  explicit Generator(const GeneratorState& state);

  GeneratorState state() const;

  /// A double in [0, 1).
  double random();

  /// A double in [low, high).
  double uniform(double low, double high);

  /// An integer in [low, high); high - low in 1 .. 2^32 - 1. A range of one value draws nothing.
  std::int64_t integers(std::int64_t low, std::int64_t high);

 private:
  __extension__ using Uint128 = unsigned __int128;

  void advance();
  std::uint64_t next_uint64();
  std::uint32_t next_uint32();

  Uint128 state_ = 0;
  Uint128 increment_ = 0;
  bool has_uint32_ = false;  // the upper half of the last 64 bits waits in uinteger_
  std::uint32_t uinteger_ = 0;
};

/// A seed from the operating system's entropy.
WALKER_SIM_EXPORT std::uint64_t draw_seed();

}  // namespace walker
