// The lidar of planar robots: rays from the trunk's origin to the static world.
#pragma once

#include <array>
#include <cstddef>

#include "robots/mujoco/engine.h"
#include "robots/mujoco/ground_line.h"

namespace walker::mujoco {

// The rays' directions are those of BipedalWalker's lidar (bipedal_walker/constants.h).
constexpr std::size_t kLidarRays = 10;
constexpr double kLidarIncrement = 0.15;  // angle between rays [rad]

/// Range over the length of the leg: BipedalWalker's 160 pixels over 2 x 34 of upper and lower leg.
constexpr double kLidarRangePerLeg = 160.0 / 68;

using LidarRanges = std::array<double, kLidarRays>;  ///< [m]; +infinity: no hit

/// Whether `cast_lidar` needs data: the static world contains meshes or height fields.
bool needs_data(const mjModel& model);

/// Returns the distances from a point to the nearest geoms of the static world. As for mj_ray, a
/// fully transparent geom does not exist. Planes are infinite, as they are for contacts; mj_ray
/// stops at the end of what is drawn.
///
///   range_i = min { t in [0, range] : origin + t (sin 0.15 i, 0, -cos 0.15 i) is on a geom }
///
/// or +infinity. Ray 0 points down, later ones further forward; they do not turn with the trunk.
///
/// Source: MuJoCo 2.2.2, mju_rayGeom, mj_rayMesh, mj_rayHfield (engine_ray.c).
/// @param range distance beyond which nothing is hit [m]
/// @param data  poses of the state; may be null unless the model needs data
/// @param line  of the ground that replaces the floor; null: the floor is flat
LidarRanges cast_lidar(const mjModel& model, const mjData* data, const Vector3& origin,
                       double range, const GroundLine* line);

}  // namespace walker::mujoco
