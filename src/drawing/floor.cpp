#include <algorithm>
#include <cmath>

#include "drawing/polygons.h"

namespace walker {
namespace {

/// Interpolates between two colours, `share` in [0, 1].
Color mixed(const Color& from, const Color& to, double share) {
  Color color{};
  for (std::size_t i = 0; i < color.size(); ++i) color[i] = from[i] + share * (to[i] - from[i]);
  return color;
}

}  // namespace

double floor_center(const Floor& floor, double x) {
  // An even number of tiles, so that the colours do not depend on the centre.
  const double step = 4 * floor.tile;
  return step * std::round(x / step);
}

Drawing floor_drawing(const Floor& floor, double center) {
  // Extent in tiles: beyond both sides of the picture, and as deep as looks good.
  constexpr int kAhead = 20;
  constexpr int kNear = -7;
  constexpr int kFar = 13;
  constexpr double kPaleness = 0.85;  // of the farthest tiles, against flicker
  const auto& [light, dark] = floor.colors;
  Drawing drawing{"floor"};
  if (!std::isfinite(floor.z)) return drawing;
  for (int row = kNear; row < kFar; ++row) {
    const double paleness = kPaleness * std::max(row, 0) / kFar;
    const Depth depth{row * floor.tile, (row + 1) * floor.tile};
    for (int column = -kAhead; column < kAhead; ++column) {
      const Color& tone = (row + column) % 2 == 0 ? light : dark;
      const Color color = mixed(tone, light, paleness);
      const double left = center + column * floor.tile;
      add_wall({left, floor.z}, {left + floor.tile, floor.z}, depth, color, color, drawing);
    }
  }
  return drawing;
}

}  // namespace walker
