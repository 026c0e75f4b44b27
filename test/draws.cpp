// C interface of the core's random draws, which tests compare with NumPy's and Gymnasium's.
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <memory>
#include <string>
#include <vector>

#include "base/random.h"
#include "episode/checked_world.h"
#include "episode/disturbances.h"
#include "robots/bipedal_walker/ground_numbers.h"
#include "robots/mujoco/level_ground.h"
#include "walker_sim/environment.h"
#include "walker_sim/export.h"
#include "walker_sim/registry.h"

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

/// What an episode draws in a world before its reset.
struct Drawn {
  Drawn(const std::string& id, const std::string& world, std::uint64_t seed)
      : environment(walker::make(id)), generator(seed) {
    const walker::CheckedWorld checked(environment->specification(),
                                       walker::parse_world(world, "of the test"));
    world_drawn = checked.draw(generator.state());
    values = later_values().present();
  }

  walker::EpisodeValues later_values() const {
    return {world_drawn, environment->specification().dt, generator.state()};
  }

  std::unique_ptr<walker::Environment> environment;
  walker::Generator generator;
  walker::World world_drawn;
  walker::WorldValues values;  // that act in the first step
};

walker::Ground draw_level(const std::string& id, const std::string& world, std::uint64_t seed) {
  Drawn drawn(id, world, seed);
  if (id.rfind("Bipedal", 0) == 0) {
    return walker::bipedal_walker::draw_ground(
        drawn.generator, id == "BipedalWalkerHardcore-v3",
        walker::bipedal_walker::settings_of(drawn.values).level);
  }
  return walker::draw_ground(drawn.generator, walker::mujoco::kGroundSize, false,
                             walker::mujoco::level_of(drawn.values).value());
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
WALKER_SIM_EXPORT std::size_t walker_sim_test_ground(bool hardcore, std::uint64_t seed,
                                                     double* numbers) {
  const std::vector<double> drawn = walker::bipedal_walker::ground_numbers(hardcore, seed);
  std::copy(drawn.begin(), drawn.end(), numbers);
  return drawn.size();
}

/// Draws the level of an episode in a world, a text as for `parse_world`.
/// @param numbers has room for 50000 numbers: ground points, then four corners of each box
/// @return the number of ground points; `count` receives that of all numbers
WALKER_SIM_EXPORT std::size_t walker_sim_test_level(const char* id, const char* world,
                                                    std::uint64_t seed, double* numbers,
                                                    std::size_t* count) {
  const walker::Ground ground = draw_level(id, world, seed);
  double* next = numbers;
  const auto add = [&next](const auto& points) {
    for (const walker::Point& point : points) {
      *next++ = point.x;
      *next++ = point.y;
    }
  };
  add(ground.points);
  for (const auto& obstacle : ground.obstacles) add(obstacle);
  *count = static_cast<std::size_t>(next - numbers);
  return ground.points.size();
}

/// Writes the values that act in each step of an episode, in the order of their names.
WALKER_SIM_EXPORT void walker_sim_test_values(const char* id, const char* world, std::uint64_t seed,
                                              std::uint32_t steps, double* numbers) {
  walker::EpisodeValues values = Drawn(id, world, seed).later_values();
  for (std::uint32_t i = 1; i <= steps; ++i) {
    values.begin_step(i);
    for (const auto& name_value : values.present()) *numbers++ = name_value.second;
  }
}

/// Writes push along x and z and action of each step of an episode, to which zeros are given.
WALKER_SIM_EXPORT void walker_sim_test_disturbances(const char* id, const char* world,
                                                    std::uint64_t seed, std::uint32_t steps,
                                                    double* numbers) {
  const Drawn drawn(id, world, seed);
  const walker::Specification& specification = drawn.environment->specification();
  walker::Disturbances disturbances(drawn.values, specification, drawn.generator.state());
  const std::vector<double> zeros(specification.action_size());
  walker::RobotStep step;
  for (std::uint32_t i = 1; i <= steps; ++i) {
    disturbances.begin_step(zeros.data(), i, step);
    numbers = std::copy(step.push.begin(), step.push.end(), numbers);
    numbers = std::copy_n(step.action, zeros.size(), numbers);
  }
}
}
