#include "robots/mujoco/lidar.h"

#include <cmath>
#include <limits>

#include "robots/mujoco/floor.h"
#include "robots/mujoco/planar_model.h"

namespace walker::mujoco {
namespace {

/// Returns the rays' directions in the world, unit vectors.
std::array<Vector3, kLidarRays> directions() {
  std::array<Vector3, kLidarRays> rays{};
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const double angle = kLidarIncrement * static_cast<double>(i);
    rays[i] = {std::sin(angle), 0, -std::cos(angle)};
  }
  return rays;
}

bool is_static(const mjModel& model, int geom) {
  return carrier_of(model, model.geom_bodyid[geom]) == 0;
}

/// Whether the geom is not fully transparent.
bool is_visible(const mjModel& model, int geom) {
  const int material = model.geom_matid[geom];
  return (material < 0 ? at(model.geom_rgba, geom, 4) : at(model.mat_rgba, material, 4))[3] != 0;
}

bool is_surface(const mjModel& model, int geom) {
  return model.geom_type[geom] == mjGEOM_MESH || model.geom_type[geom] == mjGEOM_HFIELD;
}

/// Whether the geom is farther away than the range. A bounding radius of 0 means that it has none.
bool is_beyond(const mjModel& model, int geom, const Frame& frame, const Vector3& origin,
               double range) {
  const double radius = model.geom_rbound[geom];
  return radius > 0 && mju_dist3(frame.position.data(), origin.data()) > radius + range;
}

}  // namespace

bool needs_data(const mjModel& model) {
  for (int geom = 0; geom < model.ngeom; ++geom) {
    if (is_static(model, geom) && is_surface(model, geom)) return true;
  }
  return false;
}

/// This does not call mj_ray, which can exclude one body only and needs mjData: poses of static
/// geoms are known from the model, so a kernel's world needs no pass of kinematics.
LidarRanges cast_lidar(const mjModel& model, const mjData* data, const Vector3& origin,
                       double range, const GroundLine* line) {
  static const std::array<Vector3, kLidarRays> kRays = directions();
  constexpr std::array<mjtNum, 3> kUnbounded{};  // size of an infinite plane
  LidarRanges ranges;
  ranges.fill(std::numeric_limits<double>::infinity());
  const int replaced = line == nullptr ? -1 : floor_of(model);
  for (std::size_t i = 0; i < ranges.size() && line != nullptr; ++i) {
    ranges[i] = line->cast({origin[0], origin[2]}, {kRays[i][0], kRays[i][2]}, range);
  }
  for (int geom = 0; geom < model.ngeom; ++geom) {
    if (geom == replaced || !is_static(model, geom) || !is_visible(model, geom)) continue;
    const Frame frame = geom_frame_in(model, 0, geom);
    if (is_beyond(model, geom, frame, origin, range)) continue;
    const int type = model.geom_type[geom];
    std::array<mjtNum, 9> rotation{};
    mju_quat2Mat(rotation.data(), frame.quaternion.data());
    const mjtNum* const size =
        type == mjGEOM_PLANE ? kUnbounded.data() : at(model.geom_size, geom, 3);
    for (std::size_t i = 0; i < ranges.size(); ++i) {
      const mjtNum* const ray = kRays[i].data();
      double distance = -1;
      if (type == mjGEOM_MESH) {
        distance = mj_rayMesh(&model, data, geom, origin.data(), ray);
      } else if (type == mjGEOM_HFIELD) {
        distance = mj_rayHfield(&model, data, geom, origin.data(), ray);
      } else {
        distance =
            mju_rayGeom(frame.position.data(), rotation.data(), size, origin.data(), ray, type);
      }
      if (0 <= distance && distance <= range && distance < ranges[i]) ranges[i] = distance;
    }
  }
  return ranges;
}

}  // namespace walker::mujoco
