#include "base/random.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

namespace walker {
namespace {

// Constants of NumPy's SeedSequence (numpy/random/bit_generator.pyx), after O'Neill's seed_seq_fe.
constexpr std::uint32_t kInitA = 0x43b0d7e5;
constexpr std::uint32_t kMultiplierA = 0x931e8875;
constexpr std::uint32_t kInitB = 0x8b51f9dd;
constexpr std::uint32_t kMultiplierB = 0x58f38ded;
constexpr std::uint32_t kMixLeft = 0xca01f9dd;
constexpr std::uint32_t kMixRight = 0x4973f715;
constexpr unsigned kShift = 16;

constexpr std::size_t kPoolSize = 4;
using Pool = std::array<std::uint32_t, kPoolSize>;

/// SeedSequence's hash of one word; `constant` advances with every word.
std::uint32_t hash(std::uint32_t value, std::uint32_t& constant, std::uint32_t multiplier) {
  value ^= constant;
  constant *= multiplier;
  value *= constant;
  return value ^ (value >> kShift);
}

std::uint32_t mix(std::uint32_t left, std::uint32_t right) {
  const std::uint32_t result = kMixLeft * left - kMixRight * right;
  return result ^ (result >> kShift);
}

/// SeedSequence(words).pool: the first words, zero-padded, each mixed into the others, and then all
/// further words mixed into each.
Pool entropy_pool(const std::uint32_t* words, std::size_t count) {
  Pool pool{};
  std::copy_n(words, std::min(count, kPoolSize), pool.begin());
  std::uint32_t constant = kInitA;
  for (std::uint32_t& word : pool) word = hash(word, constant, kMultiplierA);
  for (std::size_t source = 0; source < std::max(kPoolSize, count); ++source) {
    for (std::size_t target = 0; target < kPoolSize; ++target) {
      if (source == target) continue;
      const std::uint32_t word = source < kPoolSize ? pool[source] : words[source];
      pool[target] = mix(pool[target], hash(word, constant, kMultiplierA));
    }
  }
  return pool;
}

/// SeedSequence(words).generate_state(4, uint64): state high, low, sequence high, low.
std::array<std::uint64_t, 4> seed_words(const std::uint32_t* words, std::size_t count) {
  const Pool pool = entropy_pool(words, count);
  std::array<std::uint64_t, 4> state{};
  std::uint32_t constant = kInitB;
  for (std::size_t i = 0; i < 2 * state.size(); ++i) {
    const std::uint64_t half = hash(pool[i % kPoolSize], constant, kMultiplierB);
    state[i / 2] |= half << (32U * (i % 2));
  }
  return state;
}

std::uint32_t low_half(std::uint64_t word) { return static_cast<std::uint32_t>(word); }
std::uint32_t high_half(std::uint64_t word) { return static_cast<std::uint32_t>(word >> 32U); }

void check(bool is_right, const char* name, std::uint64_t value, const char* allowed) {
  if (is_right) return;
  throw std::invalid_argument(std::string(name) + " = " + std::to_string(value) + ": " + allowed);
}

}  // namespace

Generator::Generator(std::uint64_t seed) {
  const std::array<std::uint32_t, 2> words{low_half(seed), high_half(seed)};
  seed_with(words.data(), words.size());
}

Generator::Generator(const std::vector<std::uint32_t>& words) {
  seed_with(words.data(), words.size());
}

void Generator::seed_with(const std::uint32_t* words, std::size_t count) {
  const std::array<std::uint64_t, 4> state = seed_words(words, count);
  const Uint128 initial = (Uint128{state[0]} << 64U) | state[1];
  const Uint128 sequence = (Uint128{state[2]} << 64U) | state[3];
  increment_ = (sequence << 1U) | 1U;
  advance();
  state_ += initial;
  advance();
}

Generator::Generator(const GeneratorState& state)
    : state_((Uint128{state[0]} << 64U) | state[1]),
      increment_((Uint128{state[2]} << 64U) | state[3]),
      has_uint32_(state[4] != 0),
      uinteger_(static_cast<std::uint32_t>(state[5])) {
  check(state[3] % 2 == 1, "generator_state[3] (increment, low half)", state[3], "must be odd");
  check(state[4] <= 1, "generator_state[4] (has_uint32)", state[4], "must be 0 or 1");
  check(state[5] <= std::numeric_limits<std::uint32_t>::max(), "generator_state[5] (uinteger)",
        state[5], "must be below 2^32");
}

GeneratorState Generator::state() const {
  return {static_cast<std::uint64_t>(state_ >> 64U),
          static_cast<std::uint64_t>(state_),
          static_cast<std::uint64_t>(increment_ >> 64U),
          static_cast<std::uint64_t>(increment_),
          std::uint64_t{has_uint32_},
          std::uint64_t{uinteger_}};
}

void Generator::advance() {
  constexpr Uint128 kMultiplier = (Uint128{2549297995355413924ULL} << 64U) | 4865540595714422341ULL;
  state_ = state_ * kMultiplier + increment_;
}

std::uint64_t Generator::next_uint64() {
  advance();
  const std::uint64_t folded =
      static_cast<std::uint64_t>(state_ >> 64U) ^ static_cast<std::uint64_t>(state_);
  const auto rotation = static_cast<unsigned>(state_ >> 122U);
  return (folded >> rotation) | (folded << ((64U - rotation) & 63U));
}

std::uint32_t Generator::next_uint32() {
  if (has_uint32_) {
    has_uint32_ = false;
    return uinteger_;
  }
  const std::uint64_t both = next_uint64();
  has_uint32_ = true;
  uinteger_ = static_cast<std::uint32_t>(both >> 32U);
  return static_cast<std::uint32_t>(both);
}

double Generator::random() {
  return static_cast<double>(next_uint64() >> 11U) * (1.0 / 9007199254740992.0);
}

double Generator::uniform(double low, double high) {
  const double range = high - low;
  return low + range * random();
}

void Generator::normals(double* values, std::size_t count) {
  for (std::size_t i = 0; i < count; i += 2) {
    double x = 0;
    double y = 0;
    double square = 0;
    do {  // a point of the unit disk, not its centre
      x = uniform(-1, 1);
      y = uniform(-1, 1);
      square = x * x + y * y;
    } while (square >= 1 || square == 0);
    const double scale = std::sqrt(-2 * std::log(square) / square);
    values[i] = x * scale;
    if (i + 1 < count) values[i + 1] = y * scale;
  }
}

std::int64_t Generator::integers(std::int64_t low, std::int64_t high) {
  constexpr std::uint32_t kMax = std::numeric_limits<std::uint32_t>::max();
  // Unsigned, as the difference may overflow a signed integer.
  const std::uint64_t values = static_cast<std::uint64_t>(high) - static_cast<std::uint64_t>(low);
  if (high <= low || values > kMax) {
    throw std::invalid_argument("integers: the range [" + std::to_string(low) + ", " +
                                std::to_string(high) + ") must hold 1 .. 2^32 - 1 values");
  }
  if (values == 1) return low;
  // Lemire's method: the upper half of a 32 x 32 bit product, rejected if the lower half is biased.
  const auto count = static_cast<std::uint32_t>(values);
  std::uint64_t product = std::uint64_t{next_uint32()} * count;
  if (static_cast<std::uint32_t>(product) < count) {
    const std::uint32_t threshold = (kMax - count + 1U) % count;
    while (static_cast<std::uint32_t>(product) < threshold) {
      product = std::uint64_t{next_uint32()} * count;
    }
  }
  return low + static_cast<std::int64_t>(product >> 32U);
}

Generator derive(const GeneratorState& episode, const std::string& purpose) {
  constexpr std::uint32_t kOffsetBasis = 0x811c9dc5;
  constexpr std::uint32_t kPrime = 0x01000193;
  std::vector<std::uint32_t> words;
  for (const std::uint64_t word : episode) {
    words.push_back(low_half(word));
    words.push_back(high_half(word));
  }
  std::uint32_t sum = kOffsetBasis;
  for (const char byte : purpose) sum = (sum ^ static_cast<unsigned char>(byte)) * kPrime;
  words.push_back(sum);
  return Generator(words);
}

std::uint64_t draw_seed() {
  std::random_device device;
  return (std::uint64_t{device()} << 32U) | device();
}

}  // namespace walker
