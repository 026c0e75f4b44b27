// Compares pictures with those in test/recordings/pictures.
#pragma once

#include <cairo.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>

#include "base/shared_library.h"
#include "walker_sim/renderer.h"

namespace walker {

constexpr std::size_t kColors = 3;

/// Reads a picture written by record_pictures.py. The image has color but no depth.
inline Image read_picture(const std::string& name) {
  const SharedLibrary cairo("libcairo.so.2", "libcairo2");
  const decltype(&cairo_image_surface_create_from_png) read =
      cairo.function("cairo_image_surface_create_from_png");
  const decltype(&cairo_surface_status) status = cairo.function("cairo_surface_status");
  const decltype(&cairo_image_surface_get_width) width =
      cairo.function("cairo_image_surface_get_width");
  const decltype(&cairo_image_surface_get_height) height =
      cairo.function("cairo_image_surface_get_height");
  const decltype(&cairo_image_surface_get_stride) stride =
      cairo.function("cairo_image_surface_get_stride");
  const decltype(&cairo_image_surface_get_data) data =
      cairo.function("cairo_image_surface_get_data");
  const decltype(&cairo_surface_destroy) destroy = cairo.function("cairo_surface_destroy");

  cairo_surface_t* const surface =
      read((WALKER_SIM_RECORDINGS "/pictures/" + name + ".png").c_str());
  if (status(surface) != CAIRO_STATUS_SUCCESS) {
    destroy(surface);
    throw std::runtime_error("picture " + name + ": cannot be read");
  }
  Image image;
  image.width = static_cast<std::uint32_t>(width(surface));
  image.height = static_cast<std::uint32_t>(height(surface));
  for (std::uint32_t y = 0; y < image.height; ++y) {
    const unsigned char* row =
        data(surface) + std::size_t{y} * static_cast<std::size_t>(stride(surface));
    for (std::uint32_t x = 0; x < image.width; ++x) {
      std::uint32_t pixel = 0;  // 0x..RRGGBB
      std::memcpy(&pixel, row + std::size_t{x} * sizeof(pixel), sizeof(pixel));
      for (const unsigned shift : {16U, 8U, 0U}) {
        image.rgb.push_back(static_cast<std::uint8_t>(pixel >> shift));
      }
    }
  }
  destroy(surface);
  return image;
}

inline Image draw(Renderer& renderer, const StateCapture& captured) {
  Image image;
  renderer.render(captured, {}, image);
  return image;
}

inline double color_at(const Image& image, std::size_t x, std::size_t y, std::size_t color) {
  return image.rgb.at((y * image.width + x) * kColors + color);
}

/// Downsamples: each pixel is the mean of `factor` x `factor` pixels.
inline Image shrunk(const Image& image, std::uint32_t factor) {
  Image small;
  small.width = image.width / factor;
  small.height = image.height / factor;
  for (std::uint32_t y = 0; y < small.height; ++y) {
    for (std::uint32_t x = 0; x < small.width; ++x) {
      for (std::size_t color = 0; color < kColors; ++color) {
        double sum = 0;
        for (std::uint32_t i = 0; i < factor * factor; ++i) {
          sum += color_at(image, x * factor + i % factor, y * factor + i / factor, color);
        }
        small.rgb.push_back(static_cast<std::uint8_t>(std::lround(sum / (factor * factor))));
      }
    }
  }
  return small;
}

/// Structural similarity of one channel in the 7 x 7 window with this upper left corner.
inline double window_similarity(const Image& a, const Image& b, std::size_t left, std::size_t top,
                                std::size_t color) {
  constexpr std::size_t kSide = 7;
  constexpr double kCount = kSide * kSide;
  constexpr double kFull = 255;
  constexpr double kC1 = (0.01 * kFull) * (0.01 * kFull);
  constexpr double kC2 = (0.03 * kFull) * (0.03 * kFull);
  double sum_a = 0;
  double sum_b = 0;
  double sum_aa = 0;
  double sum_bb = 0;
  double sum_ab = 0;
  for (std::size_t i = 0; i < kSide * kSide; ++i) {
    const std::size_t x = left + i % kSide;
    const std::size_t y = top + i / kSide;
    const double value_a = color_at(a, x, y, color);
    const double value_b = color_at(b, x, y, color);
    sum_a += value_a;
    sum_b += value_b;
    sum_aa += value_a * value_a;
    sum_bb += value_b * value_b;
    sum_ab += value_a * value_b;
  }
  const double mean_a = sum_a / kCount;
  const double mean_b = sum_b / kCount;
  const double variance_a = (sum_aa - sum_a * mean_a) / (kCount - 1);
  const double variance_b = (sum_bb - sum_b * mean_b) / (kCount - 1);
  const double covariance = (sum_ab - sum_a * mean_b) / (kCount - 1);
  return (2 * mean_a * mean_b + kC1) * (2 * covariance + kC2) /
         ((mean_a * mean_a + mean_b * mean_b + kC1) * (variance_a + variance_b + kC2));
}

/// Structural similarity of two pictures, 1 if equal: the mean over all windows and channels, as
/// scikit-image's structural_similarity computes it by default (Wang et al., Image quality
/// assessment: from error visibility to structural similarity, 2004).
inline double structural_similarity(const Image& a, const Image& b) {
  constexpr std::size_t kSide = 7;
  if (a.width != b.width || a.height != b.height || a.rgb.size() != b.rgb.size()) {
    throw std::invalid_argument("pictures of different sizes");
  }
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t top = 0; top + kSide <= a.height; ++top) {
    for (std::size_t left = 0; left + kSide <= a.width; ++left) {
      for (std::size_t color = 0; color < kColors; ++color, ++count) {
        sum += window_similarity(a, b, left, top, color);
      }
    }
  }
  return sum / static_cast<double>(count);
}

/// Fraction of pixels with a channel that differs by more than a quarter of the full scale. Detects
/// what barely changes the structural similarity of mostly uniform pictures.
inline double share_of_other_pixels(const Image& a, const Image& b) {
  constexpr int kMuch = 64;
  if (a.rgb.size() != b.rgb.size()) throw std::invalid_argument("pictures of different sizes");
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.rgb.size(); i += kColors) {
    bool differs = false;
    for (std::size_t color = 0; color < kColors; ++color) {
      differs = differs || std::abs(int{a.rgb[i + color]} - int{b.rgb[i + color]}) > kMuch;
    }
    count += differs ? 1 : 0;
  }
  return static_cast<double>(count * kColors) / static_cast<double>(a.rgb.size());
}

}  // namespace walker
