// NumPy's default random generator, with bitwise equal results.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "walker_sim/export.h"
#include "walker_sim/generator_state.h"

namespace walker {

/// `numpy.random.Generator(PCG64(SeedSequence(seed)))`, with the methods that environments need.
///
/// Sources: NumPy's bit_generator.pyx (SeedSequence), pcg64.h (PCG XSL-RR 128/64 by M. O'Neill),
/// distributions.c (doubles from 53 bits; bounded integers by Lemire's method over 32-bit halves).
class WALKER_SIM_EXPORT Generator {
 public:
  /// Seeds as `default_rng(seed)` does, with all 64 bits.
  explicit Generator(std::uint64_t seed);

  /// Seeds as `default_rng(words)` does with a list of numbers below 2^32.
  explicit Generator(const std::vector<std::uint32_t>& words);

  /// Continues from a state returned by `state()`.
  /// @throws std::invalid_argument naming the invalid field
  explicit Generator(const GeneratorState& state);

  GeneratorState state() const;

  /// Draws a double from [0, 1).
  double random();

  /// Draws a double from [low, high).
  double uniform(double low, double high);

  /// Draws independent numbers of mean 0 and standard deviation 1, by the polar method of Marsaglia
  /// and Bray (1964); NumPy's own `normal` uses another one.
  void normals(double* values, std::size_t count);

  /// Draws an integer from [low, high). A range of one value does not advance the generator.
  /// @throws std::invalid_argument unless high - low is in 1 .. 2^32 - 1
  std::int64_t integers(std::int64_t low, std::int64_t high);

 private:
  __extension__ using Uint128 = unsigned __int128;

  void seed_with(const std::uint32_t* words, std::size_t count);
  void advance();
  std::uint64_t next_uint64();
  std::uint32_t next_uint32();

  Uint128 state_ = 0;
  Uint128 increment_ = 0;
  bool has_uint32_ = false;  // uinteger_ holds the unused upper half of the last 64-bit draw
  std::uint32_t uinteger_ = 0;
};

/// Returns a generator of its own for one purpose of an episode, without drawing from the
/// episode's: `default_rng` of the state's six words of 64 bits, each as its low and its high half,
/// and of the FNV-1a hash (32 bits) of the purpose.
/// @param episode state before the reset
WALKER_SIM_EXPORT Generator derive(const GeneratorState& episode, const std::string& purpose);

/// Draws a seed from the operating system's entropy.
WALKER_SIM_EXPORT std::uint64_t draw_seed();

}  // namespace walker
