#include "base/range_finder.h"

#include <cmath>

namespace walker {

void add_range_noise(const std::vector<double>& noise, double maximum, double* ranges) {
  for (std::size_t i = 0; i < noise.size(); ++i) {
    if (std::isfinite(ranges[i])) ranges[i] = std::clamp(ranges[i] + noise[i], 0.0, maximum);
  }
}

double maximum_range_of(const Measurements& measurements, const RangeFinder& finder) {
  const double given = measurements.maximum_range;
  const bool is_specified =
      given == 0 || static_cast<float>(given) == static_cast<float>(finder.maximum_range);
  return is_specified ? finder.maximum_range : given;
}

WorldParameter lidar_range_parameter(double default_range) {
  return {"lidar_range",
          "m",
          "Length of the lidar's rays, of which distances are observed as fractions.",
          default_range,
          0.1,
          50};
}

WorldParameter range_noise_parameter() {
  return {
      "range_noise", "m", "Standard deviation of the errors of the lidar's distances.", 0, 0, 10};
}

}  // namespace walker
