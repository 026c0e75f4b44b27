#include "bipedal_walker/canvas.h"

#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

#include "core/shared_library.h"

namespace walker::bipedal_walker {
namespace {

/// What we use of cairo, found when the first canvas is made.
class Cairo {
 private:
  /// Becomes the function of this name.
  struct Symbol {
    const SharedLibrary& library;
    const char* name;

    template <typename Function>
    operator Function() const {
      return library.function<Function>(name);
    }
  };

  Symbol find(const char* name) const { return {library_, name}; }

  SharedLibrary library_{"libcairo.so.2", "libcairo2"};

 public:
  decltype(&cairo_image_surface_create) create_surface = find("cairo_image_surface_create");
  decltype(&cairo_surface_destroy) destroy_surface = find("cairo_surface_destroy");
  decltype(&cairo_surface_flush) flush = find("cairo_surface_flush");
  decltype(&cairo_image_surface_get_data) data = find("cairo_image_surface_get_data");
  decltype(&cairo_image_surface_get_stride) stride = find("cairo_image_surface_get_stride");
  decltype(&cairo_create) create = find("cairo_create");
  decltype(&cairo_destroy) destroy = find("cairo_destroy");
  decltype(&cairo_status) status = find("cairo_status");
  decltype(&cairo_status_to_string) status_text = find("cairo_status_to_string");
  decltype(&cairo_set_source_rgba) set_color = find("cairo_set_source_rgba");
  decltype(&cairo_set_antialias) set_antialias = find("cairo_set_antialias");
  decltype(&cairo_set_line_width) set_line_width = find("cairo_set_line_width");
  decltype(&cairo_set_line_cap) set_line_cap = find("cairo_set_line_cap");
  decltype(&cairo_move_to) move_to = find("cairo_move_to");
  decltype(&cairo_line_to) line_to = find("cairo_line_to");
  decltype(&cairo_fill) fill = find("cairo_fill");
  decltype(&cairo_stroke) stroke = find("cairo_stroke");
  decltype(&cairo_paint) paint = find("cairo_paint");
};

const Cairo& cairo() {
  static const Cairo kCairo;
  return kCairo;
}

/// cairo counts in 1/256 pixels, in 32 bits.
Pixel within_reach(const Pixel& point) {
  constexpr double kFarthest = 1e5;
  return {std::clamp(point[0], -kFarthest, kFarthest), std::clamp(point[1], -kFarthest, kFarthest)};
}

bool is_somewhere(const Pixel& point) { return !std::isnan(point[0]) && !std::isnan(point[1]); }

}  // namespace

struct Canvas::Surface {
  Surface(std::uint32_t width, std::uint32_t height)
      : surface(cairo().create_surface(CAIRO_FORMAT_RGB24, static_cast<int>(width),
                                       static_cast<int>(height))),
        context(cairo().create(surface)) {}
  Surface(const Surface&) = delete;
  Surface& operator=(const Surface&) = delete;
  ~Surface() {
    cairo().destroy(context);
    cairo().destroy_surface(surface);
  }

  cairo_surface_t* surface;
  cairo_t* context;
};

Canvas::Canvas(std::uint32_t width, std::uint32_t height, double line)
    : width_(width),
      height_(height),
      line_(line),
      surface_(std::make_unique<Surface>(width, height)) {
  const cairo_status_t status = cairo().status(surface_->context);
  if (status != CAIRO_STATUS_SUCCESS) {
    throw std::runtime_error(std::string("cairo: ") + cairo().status_text(status));
  }
  cairo().set_line_cap(surface_->context, CAIRO_LINE_CAP_SQUARE);
}

Canvas::~Canvas() = default;

void Canvas::clear(const Color& color) {
  set_ink(color, Edge::hard);
  cairo().paint(surface_->context);
}

void Canvas::fill(const std::vector<Pixel>& polygon, const Color& color) {
  if (!std::all_of(polygon.begin(), polygon.end(), is_somewhere)) return;
  set_ink(color, Edge::hard);
  for (const Pixel& point : polygon) {
    const auto [x, y] = within_reach(point);
    cairo().line_to(surface_->context, x, y);
  }
  cairo().fill(surface_->context);
}

void Canvas::draw_line(const Pixel& from, const Pixel& to, const Color& color, Edge edge) {
  if (!is_somewhere(from) || !is_somewhere(to)) return;
  const auto [x0, y0] = within_reach(from);
  const auto [x1, y1] = within_reach(to);
  const double length = std::hypot(x1 - x0, y1 - y0);
  // cairo measures the thickness across the line.
  const double slant = length > 0 ? std::max(std::abs(x1 - x0), std::abs(y1 - y0)) / length : 1;
  set_ink(color, edge);
  cairo().set_line_width(surface_->context, line_ * slant);
  cairo().move_to(surface_->context, x0, y0);
  cairo().line_to(surface_->context, x1, y1);
  cairo().stroke(surface_->context);
}

void Canvas::outline(const std::vector<Pixel>& polygon, const Color& color, Edge edge) {
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    draw_line(polygon[i], polygon[(i + 1) % polygon.size()], color, edge);
  }
}

void Canvas::read(std::vector<std::uint8_t>& rgb) const {
  cairo().flush(surface_->surface);
  const unsigned char* row = cairo().data(surface_->surface);
  const int stride = cairo().stride(surface_->surface);
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

void Canvas::set_ink(const Color& color, Edge edge) {
  cairo().set_color(surface_->context, color[0], color[1], color[2], color[3]);
  cairo().set_antialias(surface_->context,
                        edge == Edge::hard ? CAIRO_ANTIALIAS_NONE : CAIRO_ANTIALIAS_DEFAULT);
}

}  // namespace walker::bipedal_walker
