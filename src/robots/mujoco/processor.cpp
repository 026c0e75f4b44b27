#include "robots/mujoco/processor.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <stdexcept>

#include "base/random.h"
#include "base/state_bytes.h"

namespace walker::mujoco {
namespace {

/// Returns a hash of sin, cos and pow of 20,000 arguments each. Some results of each function
/// differ between the variants.
std::uint64_t hash_of_results() {
  constexpr int kArguments = 20000;
  std::uint64_t hash = 0;
  Generator generator(0);
  for (int i = 0; i < kArguments; ++i) {
    const double angle = generator.uniform(-4, 4);
    const double base = generator.uniform(0, 1);
    const double exponent = generator.uniform(0, 4);
    const std::array<double, 3> results{std::sin(angle), std::cos(angle), std::pow(base, exponent)};
    hash = hash * 31 + checksum(reinterpret_cast<const std::byte*>(results.data()), sizeof results);
  }
  return hash;
}

std::string name_variant() {
  constexpr std::uint64_t kFma = 0x6de57019e6faba9c;
  constexpr std::uint64_t kNoFma = 0x0a4eadacd8eab543;
  const std::uint64_t hash = hash_of_results();
  if (hash == kFma) return "fma";
  if (hash == kNoFma) return "no fma";
  std::array<char, 17> digits{};
  std::snprintf(digits.data(), digits.size(), "%016llx", static_cast<unsigned long long>(hash));
  return digits.data();
}

}  // namespace

bool has_needed_instructions() {
#ifdef __x86_64__
  return __builtin_cpu_supports("avx") != 0;
#else
  return true;
#endif
}

void check_processor(bool has_needed) {
  if (has_needed) return;
  throw std::runtime_error(
      "MuJoCo's library needs a processor with AVX; this one, or its system, does not have it. "
      "BipedalWalker runs without");
}

const std::string& libm_variant() {
  static const std::string kVariant = name_variant();
  return kVariant;
}

}  // namespace walker::mujoco
