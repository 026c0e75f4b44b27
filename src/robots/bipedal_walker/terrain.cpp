#include "robots/bipedal_walker/terrain.h"

#include <cmath>

namespace walker::bipedal_walker {

Terrain generate_terrain(Generator& generator, bool hardcore, const Level& level) {
  return walker::generate_terrain(generator, kCourseSize, hardcore, level);
}

Clouds generate_clouds(Generator& generator) {
  Clouds clouds{};
  const double y = kViewportHeight / kScale * 3 / 4;
  for (Cloud& cloud : clouds) {
    const double x = generator.uniform(0, kTerrainLength) * kTerrainStep;
    for (std::size_t a = 0; a < cloud.size(); ++a) {
      const double angle = 3.14 * 2 * static_cast<double>(a) / 5;
      const double left = x + 15 * kTerrainStep * std::sin(angle);
      cloud[a].x = left + generator.uniform(0, 5 * kTerrainStep);
      const double low = y + 5 * kTerrainStep * std::cos(angle);
      cloud[a].y = low + generator.uniform(0, 5 * kTerrainStep);
    }
  }
  return clouds;
}

}  // namespace walker::bipedal_walker
