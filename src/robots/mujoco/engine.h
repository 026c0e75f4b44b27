// MuJoCo's header, with smart pointers for its objects, conversions of its arrays, and frames of
// bodies and geoms.
#pragma once

#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
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

/// A frame relative to another, in MuJoCo's format.
struct Frame {
  std::array<mjtNum, 3> position{};
  std::array<mjtNum, 4> quaternion{1, 0, 0, 0};  // w first
};

inline Frame frame_at(const mjtNum* positions, const mjtNum* quaternions, int index) {
  Frame frame;
  std::copy_n(at(positions, index, 3), 3, frame.position.begin());
  std::copy_n(at(quaternions, index, 4), 4, frame.quaternion.begin());
  return frame;
}

inline Frame compose(const Frame& outer, const Frame& inner) {
  Frame frame;
  mju_mulPose(frame.position.data(), frame.quaternion.data(), outer.position.data(),
              outer.quaternion.data(), inner.position.data(), inner.quaternion.data());
  return frame;
}

/// Returns the frame of a body in the body that carries it.
/// @param carrier `carrier_of(model, body)`
inline Frame frame_in(const mjModel& model, int carrier, int body) {
  Frame frame;
  for (; body != carrier; body = model.body_parentid[body]) {
    frame = compose(frame_at(model.body_pos, model.body_quat, body), frame);
  }
  return frame;
}

/// Returns the frame of a geom in the body that carries it.
/// @param carrier of the geom's body
inline Frame geom_frame_in(const mjModel& model, int carrier, int geom) {
  return compose(frame_in(model, carrier, model.geom_bodyid[geom]),
                 frame_at(model.geom_pos, model.geom_quat, geom));
}

}  // namespace walker::mujoco
