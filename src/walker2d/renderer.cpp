#include "walker2d/renderer.h"

namespace walker::walker2d {

std::vector<ParameterDescription> camera_parameters() {
  constexpr double kMostPixels = 4096;
  return {
      {"width", std::int64_t{480}, "pixels", "Of the picture.", 1, kMostPixels},
      {"height", std::int64_t{480}, "pixels", "Of the picture.", 1, kMostPixels},
  };
}

std::unique_ptr<Renderer> make_renderer(const std::string& /*xml_file*/,
                                        const Parameters& /*camera*/) {
  return nullptr;
}

}  // namespace walker::walker2d
