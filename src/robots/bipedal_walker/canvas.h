// Draws polygons and lines with cairo.
#pragma once

#include <cairo.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/shared_library.h"
#include "walker_sim/specification.h"

namespace walker::bipedal_walker {

/// Functions of cairo, which is loaded when the first canvas is made.
struct Cairo {
  SharedLibrary library{"libcairo.so.2", "libcairo2"};
  decltype(&cairo_image_surface_create) create_surface =
      library.function("cairo_image_surface_create");
  decltype(&cairo_surface_destroy) destroy_surface = library.function("cairo_surface_destroy");
  decltype(&cairo_surface_flush) flush = library.function("cairo_surface_flush");
  decltype(&cairo_image_surface_get_data) data = library.function("cairo_image_surface_get_data");
  decltype(&cairo_image_surface_get_stride) stride =
      library.function("cairo_image_surface_get_stride");
  decltype(&cairo_create) create = library.function("cairo_create");
  decltype(&cairo_destroy) destroy = library.function("cairo_destroy");
  decltype(&cairo_status) status = library.function("cairo_status");
  decltype(&cairo_status_to_string) status_text = library.function("cairo_status_to_string");
  decltype(&cairo_set_source_rgba) set_color = library.function("cairo_set_source_rgba");
  decltype(&cairo_set_antialias) set_antialias = library.function("cairo_set_antialias");
  decltype(&cairo_set_line_width) set_line_width = library.function("cairo_set_line_width");
  decltype(&cairo_set_line_cap) set_line_cap = library.function("cairo_set_line_cap");
  decltype(&cairo_move_to) move_to = library.function("cairo_move_to");
  decltype(&cairo_line_to) line_to = library.function("cairo_line_to");
  decltype(&cairo_fill) fill = library.function("cairo_fill");
  decltype(&cairo_stroke) stroke = library.function("cairo_stroke");
  decltype(&cairo_paint) paint = library.function("cairo_paint");
};

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
  Canvas(std::uint32_t width, std::uint32_t height, double line)
      : width_(width),
        height_(height),
        line_(line),
        surface_(cairo().create_surface(CAIRO_FORMAT_RGB24, static_cast<int>(width),
                                        static_cast<int>(height)),
                 cairo().destroy_surface),
        context_(cairo().create(surface_.get()), cairo().destroy) {
    const cairo_status_t status = cairo().status(context_.get());
    if (status != CAIRO_STATUS_SUCCESS) {
      throw std::runtime_error(std::string("cairo: ") + cairo().status_text(status));
    }
    cairo().set_line_cap(context_.get(), CAIRO_LINE_CAP_SQUARE);
  }

  void clear(const Color& color) {
    set_ink(color, Edge::hard);
    cairo().paint(context_.get());
  }

  void fill(const std::vector<Pixel>& polygon, const Color& color) {
    if (!std::all_of(polygon.begin(), polygon.end(), is_number)) return;
    set_ink(color, Edge::hard);
    for (const Pixel& point : polygon) {
      const auto [x, y] = clamped(point);
      cairo().line_to(context_.get(), x, y);
    }
    cairo().fill(context_.get());
  }

  void draw_line(const Pixel& from, const Pixel& to, const Color& color, Edge edge) {
    if (!is_number(from) || !is_number(to)) return;
    const auto [x0, y0] = clamped(from);
    const auto [x1, y1] = clamped(to);
    const double length = std::hypot(x1 - x0, y1 - y0);
    // cairo measures the thickness perpendicular to the line.
    const double slant = length > 0 ? std::max(std::abs(x1 - x0), std::abs(y1 - y0)) / length : 1;
    set_ink(color, edge);
    cairo().set_line_width(context_.get(), line_ * slant);
    cairo().move_to(context_.get(), x0, y0);
    cairo().line_to(context_.get(), x1, y1);
    cairo().stroke(context_.get());
  }

  void outline(const std::vector<Pixel>& polygon, const Color& color, Edge edge) {
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      draw_line(polygon[i], polygon[(i + 1) % polygon.size()], color, edge);
    }
  }

  /// @param rgb receives height x width x 3 values, rows from top to bottom
  void read(std::vector<std::uint8_t>& rgb) const {
    cairo().flush(surface_.get());
    const unsigned char* row = cairo().data(surface_.get());
    const int stride = cairo().stride(surface_.get());
    rgb.resize(std::size_t{width_} * height_ * 3);
    std::uint8_t* out = rgb.data();
    for (std::uint32_t y = 0; y < height_; ++y, row += stride) {
      for (std::uint32_t x = 0; x < width_; ++x) {
        std::uint32_t pixel = 0;  // 0x00RRGGBB
        std::memcpy(&pixel, row + std::size_t{x} * sizeof(pixel), sizeof(pixel));
        *out++ = static_cast<std::uint8_t>(pixel >> 16U);
        *out++ = static_cast<std::uint8_t>(pixel >> 8U);
        *out++ = static_cast<std::uint8_t>(pixel);
      }
    }
  }

 private:
  static const Cairo& cairo() {
    static const Cairo kCairo;
    return kCairo;
  }

  /// Clamps to coordinates that cairo can represent: 32-bit fixed point, in 1/256 pixels.
  static Pixel clamped(const Pixel& point) {
    constexpr double kMaxCoordinate = 1e5;
    return {std::clamp(point[0], -kMaxCoordinate, kMaxCoordinate),
            std::clamp(point[1], -kMaxCoordinate, kMaxCoordinate)};
  }

  static bool is_number(const Pixel& point) {
    return !std::isnan(point[0]) && !std::isnan(point[1]);
  }

  void set_ink(const Color& color, Edge edge) {
    cairo().set_color(context_.get(), color[0], color[1], color[2], color[3]);
    cairo().set_antialias(context_.get(),
                          edge == Edge::hard ? CAIRO_ANTIALIAS_NONE : CAIRO_ANTIALIAS_DEFAULT);
  }

  std::uint32_t width_;
  std::uint32_t height_;
  double line_;
  std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface_;
  std::unique_ptr<cairo_t, decltype(&cairo_destroy)> context_;
};

}  // namespace walker::bipedal_walker
