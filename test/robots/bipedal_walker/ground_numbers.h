// The doubles that a reset draws, in the order of bipedal_walker_reference.ground.
#pragma once

#include <vector>

#include "robots/bipedal_walker/specification.h"
#include "robots/bipedal_walker/world_settings.h"

namespace walker::bipedal_walker {

/// Returns 200 ground points, the number of obstacles, 4 points of each, 10 clouds of 5 points, the
/// push.
inline std::vector<double> ground_numbers(bool hardcore, std::uint64_t seed) {
  Generator generator(seed);
  const Ground ground = draw_ground(generator, hardcore);
  const Clouds clouds = generate_clouds(generator);
  std::vector<double> numbers;
  const auto add = [&numbers](const auto& points) {
    for (const Point& point : points) numbers.insert(numbers.end(), {point.x, point.y});
  };
  add(ground.points);
  numbers.push_back(static_cast<double>(ground.obstacles.size()));
  for (const auto& obstacle : ground.obstacles) add(obstacle);
  for (const Cloud& cloud : clouds) add(cloud);
  numbers.push_back(generator.uniform(-kInitialPush, kInitialPush));
  return numbers;
}

}  // namespace walker::bipedal_walker
