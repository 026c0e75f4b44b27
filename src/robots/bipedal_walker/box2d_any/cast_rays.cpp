#include "robots/bipedal_walker/lidar.h"
#include "robots/bipedal_walker/physics.h"

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

}  // namespace

void cast_rays(const Physics& physics, const Terrain& /*terrain*/, const b2Vec2& origin,
               const RayEnds& ends, LidarScan& scan) {
  for (std::size_t i = 0; i < ends.size(); ++i) {
    NearestGround callback(scan[i]);
    physics.world().RayCast(&callback, origin, ends[i]);
  }
}

}  // namespace walker::bipedal_walker
