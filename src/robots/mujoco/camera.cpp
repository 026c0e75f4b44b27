#include "robots/mujoco/camera.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "base/limits.h"

namespace walker::mujoco {
namespace {

constexpr const char* kTrackingCamera = "track";

std::string text_of(const Parameters& parameters, const char* name) {
  return to_string(parameters.at(name));
}

double number(const Parameters& parameters, const char* name) {
  return std::get<double>(parameters.at(name));
}

std::int64_t integer(const Parameters& parameters, const char* name) {
  return std::get<std::int64_t>(parameters.at(name));
}

std::string cameras_of(const mjModel& model) {
  if (model.ncam == 0) return "the model has none";
  std::string text = "the model has";
  for (int i = 0; i < model.ncam; ++i) {
    const char* const name = mj_id2name(&model, mjOBJ_CAMERA, i);
    text += (i > 0 ? ", " : " ") + std::to_string(i);
    if (name != nullptr) text += std::string(" ") + name;
  }
  return text;
}

[[noreturn]] void refuse(const mjModel& model, const Parameters& camera, const char* name) {
  throw std::invalid_argument("parameter " + std::string(name) + " = " + text_of(camera, name) +
                              ": no such camera; " + cameras_of(model));
}

/// Returns the index of the model's camera; -1: the free camera.
int find_camera(const mjModel& model, const Parameters& camera) {
  const std::int64_t id = integer(camera, "camera_id");
  if (id >= model.ncam) refuse(model, camera, "camera_id");
  if (id >= 0) return static_cast<int>(id);
  const std::string name = text_of(camera, "camera_name");
  if (name.empty()) return -1;
  const int found = mj_name2id(&model, mjOBJ_CAMERA, name.c_str());
  if (found < 0 && name != kTrackingCamera) refuse(model, camera, "camera_name");
  return found;
}

}  // namespace

std::vector<ParameterDescription> camera_parameters(double distance) {
  constexpr double kFar = 1e6;
  constexpr double kTurn = 360;
  constexpr std::int64_t kSize = 480;
  return {
      {"width", kSize, "pixels", "Width of the picture.", 1, kMaxPixels},
      {"height", kSize, "pixels", "Height of the picture.", 1, kMaxPixels},
      {"camera_id", std::int64_t{-1}, "", "Index of a camera of the model; -1: by camera_name.", -1,
       std::numeric_limits<std::int32_t>::max()},
      {"camera_name", std::string(kTrackingCamera), "",
       "Name of a camera of the model; empty, or track if the model has no such camera: a free "
       "camera, set by distance, lookat, elevation and azimuth.",
       0, 0},
      {"distance", distance, "m", "Distance of the free camera from its lookat point.", 1e-3, kFar},
      {"lookat", std::vector<double>{0, 0, 1.15}, "m", "Point at which the free camera looks.",
       -kFar, kFar},
      {"elevation", -20.0, "degrees", "Elevation of the free camera's view; negative: from above.",
       -90, 90},
      {"azimuth", 90.0, "degrees", "Azimuth of the free camera's view; 90: along y.", -kTurn,
       kTurn},
      {"max_geom", std::int64_t{1000}, "", "Maximum number of shapes in a picture.", 1, 1e6},
  };
}

mjvCamera choose_camera(const mjModel& model, const Parameters& camera) {
  mjvCamera chosen;
  mjv_defaultCamera(&chosen);
  chosen.fixedcamid = find_camera(model, camera);
  chosen.type = chosen.fixedcamid < 0 ? mjCAMERA_FREE : mjCAMERA_FIXED;
  const auto& lookat = std::get<std::vector<double>>(camera.at("lookat"));
  std::copy(lookat.begin(), lookat.end(), chosen.lookat);
  chosen.distance = number(camera, "distance");
  chosen.elevation = number(camera, "elevation");
  chosen.azimuth = number(camera, "azimuth");
  return chosen;
}

Camera describe_camera(const mjModel& model, const mjvCamera& chosen, const Parameters& camera) {
  constexpr double kDegree = M_PI / 180;
  const double angle = chosen.type == mjCAMERA_FIXED ? model.cam_fovy[chosen.fixedcamid]
                                                     : double{model.vis.global.fovy};
  Camera description;
  description.width = static_cast<std::uint32_t>(integer(camera, "width"));
  description.height = static_cast<std::uint32_t>(integer(camera, "height"));
  description.focal_length = description.height / 2.0 / std::tan(angle * kDegree / 2);
  description.near = double{model.vis.map.znear} * model.stat.extent;
  description.far = double{model.vis.map.zfar} * model.stat.extent;
  return description;
}

Pose optical_frame(const mjvScene& scene) {
  const mjvGLCamera& left_eye = scene.camera[0];
  const mjvGLCamera& right_eye = scene.camera[1];
  Pose pose;
  Vector3 forward{};
  Vector3 up{};
  for (std::size_t k = 0; k < 3; ++k) {
    pose.position[k] = (double{left_eye.pos[k]} + double{right_eye.pos[k]}) / 2;
    forward[k] = double{left_eye.forward[k]};
    up[k] = double{left_eye.up[k]};
  }
  Vector3 right{};
  mju_cross(right.data(), forward.data(), up.data());
  const std::array<mjtNum, 9> axes{right[0], -up[0], forward[0],  //
                                   right[1], -up[1], forward[1],  //
                                   right[2], -up[2], forward[2]};
  std::array<mjtNum, 4> quaternion{};
  mju_mat2Quat(quaternion.data(), axes.data());
  pose.orientation = {quaternion[1], quaternion[2], quaternion[3], quaternion[0]};
  return pose;
}

}  // namespace walker::mujoco
