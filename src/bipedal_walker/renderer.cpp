#include "bipedal_walker/renderer.h"

namespace walker::bipedal_walker {

std::vector<ParameterDescription> camera_parameters() {
  constexpr double kMostPixels = 4096;
  return {
      {"width", std::int64_t{600}, "pixels", "Of the picture.", 1, kMostPixels},
      {"height", std::int64_t{400}, "pixels", "Of the picture.", 1, kMostPixels},
  };
}

std::unique_ptr<Renderer> make_renderer(const Parameters& /*camera*/) { return nullptr; }

}  // namespace walker::bipedal_walker
