#include "bipedal_walker/lidar.h"

#include <cmath>

#include "bipedal_walker/physics.h"

namespace walker::bipedal_walker {
namespace {

/// Keeps the nearest piece of ground on a ray.
class NearestGround : public b2RayCastCallback {
 public:
  explicit NearestGround(RayHit& hit) : hit_(hit) {}

  float ReportFixture(b2Fixture* fixture, const b2Vec2& /*point*/, const b2Vec2& /*normal*/,
                      float fraction) override {
    constexpr float kIgnoreFixture = -1;
    if ((fixture->GetFilterData().categoryBits & kGroundCategory) == 0) return kIgnoreFixture;
    hit_ = {fraction, true};
    return fraction;  // clips the ray: what is reported next is nearer
  }

 private:
  RayHit& hit_;
};

/// The rays as vectors [m]. Computed once, by the C library's sine as in Gymnasium.
const std::array<std::array<double, 2>, kLidarRays>& rays() {
  static const std::array<std::array<double, 2>, kLidarRays> kRays = [] {
    std::array<std::array<double, 2>, kLidarRays> vectors{};
    for (int i = 0; i < kLidarRays; ++i) {
      const double angle = 1.5 * i / 10.0;
      vectors[static_cast<std::size_t>(i)] = {std::sin(angle) * kLidarRange,
                                              std::cos(angle) * kLidarRange};
    }
    return vectors;
  }();
  return kRays;
}

}  // namespace

void cast_lidar(const b2World& world, const b2Vec2& origin, LidarScan& scan) {
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const auto [forward, down] = rays()[i];
    // Summed in double and rounded once, as Gymnasium does.
    const b2Vec2 end(static_cast<float>(double{origin.x} + forward),
                     static_cast<float>(double{origin.y} - down));
    scan[i] = {};
    NearestGround callback(scan[i]);
    world.RayCast(&callback, origin, end);
  }
}

}  // namespace walker::bipedal_walker
