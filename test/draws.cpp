// C interface of the core's random draws, which tests compare with NumPy's and Gymnasium's.
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "base/random.h"
#include "robots/bipedal_walker/terrain_numbers.h"
#include "walker_sim/export.h"

namespace {

struct Draw {
  double kind;  ///< 0: random, 1: uniform, 2: integers
  double low;
  double high;
};

double draw_one(walker::Generator& generator, const Draw& draw) {
  if (draw.kind == 0) return generator.random();
  if (draw.kind == 1) return generator.uniform(draw.low, draw.high);
  return static_cast<double>(generator.integers(static_cast<std::int64_t>(draw.low),
                                                static_cast<std::int64_t>(draw.high)));
}

}  // namespace

extern "C" {

/// @param state receives the six words of the generator's state after the draws
WALKER_SIM_EXPORT void walker_sim_test_draw(std::uint64_t seed, std::size_t count,
                                            const Draw* draws, double* numbers,
                                            std::uint64_t* state) {
  walker::Generator generator(seed);
  for (std::size_t i = 0; i < count; ++i) numbers[i] = draw_one(generator, draws[i]);
  const walker::GeneratorState words = generator.state();
  std::copy(words.begin(), words.end(), state);
}

/// @param numbers has room for 5000 numbers
/// @return their count
WALKER_SIM_EXPORT std::size_t walker_sim_test_terrain(bool hardcore, std::uint64_t seed,
                                                      double* numbers) {
  const std::vector<double> drawn = walker::bipedal_walker::terrain_numbers(hardcore, seed);
  std::copy(drawn.begin(), drawn.end(), numbers);
  return drawn.size();
}
}
