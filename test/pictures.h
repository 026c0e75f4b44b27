// Draws pictures, and reads their colors.
#pragma once

#include <cstddef>

#include "walker_sim/renderer.h"

namespace walker {

constexpr std::size_t kColors = 3;

inline Image draw(Renderer& renderer, const StateCapture& captured) {
  Image image;
  renderer.render(captured, {}, image);
  return image;
}

inline double color_at(const Image& image, std::size_t x, std::size_t y, std::size_t color) {
  return image.rgb.at((y * image.width + x) * kColors + color);
}

}  // namespace walker
