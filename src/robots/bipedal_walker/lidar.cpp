#include "robots/bipedal_walker/lidar.h"

#include <cmath>

#include "robots/bipedal_walker/physics.h"

namespace walker::bipedal_walker {
namespace {

/// The rays as vectors: forward, down [m]. Computed by the C library's sine, as in Gymnasium.
const std::array<std::array<double, 2>, kLidarRays>& rays() {
  static const std::array<std::array<double, 2>, kLidarRays> kRays = [] {
    std::array<std::array<double, 2>, kLidarRays> vectors{};
    for (int i = 0; i < kLidarRays; ++i) {
      const double angle = 1.5 * i / 10.0;
      vectors[static_cast<std::size_t>(i)] = {std::sin(angle) * kLidarRange,
                                              std::cos(angle) * kLidarRange};
    }
    return vectors;
  }();
  return kRays;
}

}  // namespace

void cast_lidar(const Physics& physics, const Terrain& terrain, LidarScan& scan) {
  const b2Vec2 origin = physics.hull().GetPosition();
  RayEnds ends;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const auto [forward, down] = rays()[i];
    // Summed in double and rounded once, as Gymnasium does.
    ends[i] = b2Vec2(static_cast<float>(double{origin.x} + forward),
                     static_cast<float>(double{origin.y} - down));
  }
  scan = {};
  cast_rays(physics, terrain, origin, ends, scan);
}

}  // namespace walker::bipedal_walker
