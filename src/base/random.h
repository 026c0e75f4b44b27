// NumPy's default random generator, with bitwise equal results.
#pragma once

#include <cstdint>

#include "walker_sim/environment.h"
#include "walker_sim/export.h"

namespace walker {

/// `numpy.random.Generator(PCG64(SeedSequence(seed)))`, with the methods that environments need.
///
/// Sources: NumPy's bit_generator.pyx (SeedSequence), pcg64.h (PCG XSL-RR 128/64 by M. O'Neill),
/// distributions.c (doubles from 53 bits; bounded integers by Lemire's method over 32-bit halves).
class WALKER_SIM_EXPORT Generator {
 public:
  /// Seeds as `default_rng(seed)` does, with all 64 bits.
  explicit Generator(std::uint64_t seed);

  /// Continues from a state returned by `state()`.
  /// @throws std::invalid_argument naming the invalid field
  explicit Generator(const GeneratorState& state);

  GeneratorState state() const;

  /// Draws a double from [0, 1).
  double random();

  /// Draws a double from [low, high).
  double uniform(double low, double high);

  /// Draws an integer from [low, high). A range of one value does not advance the generator.
  /// @throws std::invalid_argument unless high - low is in 1 .. 2^32 - 1
  std::int64_t integers(std::int64_t low, std::int64_t high);

 private:
  __extension__ using Uint128 = unsigned __int128;

  void advance();
  std::uint64_t next_uint64();
  std::uint32_t next_uint32();

  Uint128 state_ = 0;
  Uint128 increment_ = 0;
  bool has_uint32_ = false;  // uinteger_ holds the unused upper half of the last 64-bit draw
  std::uint32_t uinteger_ = 0;
};

/// Draws a seed from the operating system's entropy.
WALKER_SIM_EXPORT std::uint64_t draw_seed();

}  // namespace walker
