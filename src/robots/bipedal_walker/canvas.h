// Draws polygons and lines with cairo.
#pragma once

#include <cairo.h>

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "walker_sim/specification.h"

namespace walker::bipedal_walker {

/// A point of a picture: right and down from the upper left corner [pixels]. The centre of the
/// first pixel is (0.5, 0.5).
using Pixel = std::array<double, 2>;

/// A picture to draw on. Later shapes cover earlier ones. A shape with a NaN coordinate is not
/// drawn; coordinates far outside the picture are clamped.
class Canvas {
 public:
  enum class Edge {
    hard,   ///< no antialiasing
    smooth  ///< antialiasing by pixel coverage
  };

  /// Sizes are in pixels.
  /// @param line thickness of all lines, measured along the axis less parallel to them
  /// @throws std::runtime_error if cairo is not installed, naming the package, or if cairo fails
  Canvas(std::uint32_t width, std::uint32_t height, double line);

  void clear(const Color& color);

  void fill(const std::vector<Pixel>& polygon, const Color& color);
  void draw_line(const Pixel& from, const Pixel& to, const Color& color, Edge edge);
  void outline(const std::vector<Pixel>& polygon, const Color& color, Edge edge);

  /// @param rgb receives height x width x 3 values, rows from top to bottom
  void read(std::vector<std::uint8_t>& rgb) const;

 private:
  void set_ink(const Color& color, Edge edge);

  std::uint32_t width_;
  std::uint32_t height_;
  double line_;
  std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface_;
  std::unique_ptr<cairo_t, decltype(&cairo_destroy)> context_;
};

}  // namespace walker::bipedal_walker
