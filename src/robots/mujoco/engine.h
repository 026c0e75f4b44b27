// MuJoCo's header, with smart pointers for its objects and conversions of its arrays.
#pragma once

#include <mujoco/mujoco.h>

#include <cstddef>
#include <memory>

#include "walker_sim/specification.h"

namespace walker::mujoco {

struct DeleteData {
  void operator()(mjData* data) const { mj_deleteData(data); }
};

using ModelPointer = std::shared_ptr<const mjModel>;
using DataPointer = std::unique_ptr<mjData, DeleteData>;

/// Returns a row of a MuJoCo array, such as the 3 coordinates of a position.
template <typename T>
T* at(T* array, int index, int width) {
  return array + static_cast<std::ptrdiff_t>(index) * width;
}

inline Vector3 to_vector3(const mjtNum* vector) { return {vector[0], vector[1], vector[2]}; }

/// @param quaternion in MuJoCo's order, w first
inline Pose to_pose(const mjtNum* position, const mjtNum* quaternion) {
  return {to_vector3(position), {quaternion[1], quaternion[2], quaternion[3], quaternion[0]}};
}

}  // namespace walker::mujoco
