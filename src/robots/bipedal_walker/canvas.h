// A surface to draw on, in cairo.
#pragma once

#include <cairo.h>

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "walker_sim/specification.h"

namespace walker::bipedal_walker {

/// A point of a picture: to the right and down from the upper left corner [pixels]. The middle of
/// the first pixel is (0.5, 0.5).
using Pixel = std::array<double, 2>;

/// A picture in the making. Shapes cover those drawn before. Shapes of which a point is not a
/// number are left out, and points far outside stand for those even farther.
class Canvas {
 public:
  /// How a shape's edge meets the pixels that it passes through.
  enum class Edge {
    hard,   ///< a pixel belongs to the shape or not
    smooth  ///< colours mix by how much of the pixel is covered
  };

  /// @param width  [pixels]
  /// @param height [pixels]
  /// @param line   thickness of all lines, along the axis that they are less parallel to [pixels]
  /// @throws std::runtime_error where cairo is not installed, saying what to install
  Canvas(std::uint32_t width, std::uint32_t height, double line);

  /// Begins again, in one color.
  void clear(const Color& color);

  void fill(const std::vector<Pixel>& polygon, const Color& color);
  void draw_line(const Pixel& from, const Pixel& to, const Color& color, Edge edge);
  /// The polygon's sides.
  void outline(const std::vector<Pixel>& polygon, const Color& color, Edge edge);

  /// @param rgb height x width x 3, rows from top to bottom
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
