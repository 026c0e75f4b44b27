#include "robots/mujoco/renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <future>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>

#include "base/limits.h"
#include "robots/mujoco/floor.h"
#include "robots/mujoco/offscreen_context.h"

namespace walker::mujoco {
namespace {

// ---------------------------------------------------------------- the camera

constexpr const char* kTrackingCamera = "track";

template <typename Value>
Value value_of(const Parameters& parameters, const char* name) {
  return std::get<Value>(parameters.at(name));
}

[[noreturn]] void refuse(const mjModel& model, const Parameters& camera, const char* name) {
  std::string cameras = model.ncam == 0 ? "the model has none" : "the model has";
  for (int i = 0; i < model.ncam; ++i) {
    const char* const known = mj_id2name(&model, mjOBJ_CAMERA, i);
    cameras += (i > 0 ? ", " : " ") + std::to_string(i);
    if (known != nullptr) cameras += std::string(" ") + known;
  }
  throw std::invalid_argument("parameter " + std::string(name) + " = " +
                              to_string(camera.at(name)) + ": no such camera; " + cameras);
}

/// Returns the index of the model's camera; -1: the free camera.
int find_camera(const mjModel& model, const Parameters& camera) {
  const auto id = value_of<std::int64_t>(camera, "camera_id");
  if (id >= model.ncam) refuse(model, camera, "camera_id");
  if (id >= 0) return static_cast<int>(id);
  const auto name = value_of<std::string>(camera, "camera_name");
  if (name.empty()) return -1;
  const int found = mj_name2id(&model, mjOBJ_CAMERA, name.c_str());
  if (found < 0 && name != kTrackingCamera) refuse(model, camera, "camera_name");
  return found;
}

/// @throws std::invalid_argument if the model lacks the camera; the message lists those it has
mjvCamera choose_camera(const mjModel& model, const Parameters& camera) {
  mjvCamera chosen;
  mjv_defaultCamera(&chosen);
  chosen.fixedcamid = find_camera(model, camera);
  chosen.type = chosen.fixedcamid < 0 ? mjCAMERA_FREE : mjCAMERA_FIXED;
  const auto lookat = value_of<std::vector<double>>(camera, "lookat");
  std::copy(lookat.begin(), lookat.end(), chosen.lookat);
  chosen.distance = value_of<double>(camera, "distance");
  chosen.elevation = value_of<double>(camera, "elevation");
  chosen.azimuth = value_of<double>(camera, "azimuth");
  return chosen;
}

Camera describe_camera(const mjModel& model, const mjvCamera& chosen, const Parameters& camera) {
  constexpr double kDegree = M_PI / 180;
  const double angle = chosen.type == mjCAMERA_FIXED ? model.cam_fovy[chosen.fixedcamid]
                                                     : double{model.vis.global.fovy};
  Camera description;
  description.width = static_cast<std::uint32_t>(value_of<std::int64_t>(camera, "width"));
  description.height = static_cast<std::uint32_t>(value_of<std::int64_t>(camera, "height"));
  description.focal_length = description.height / 2.0 / std::tan(angle * kDegree / 2);
  description.near = double{model.vis.map.znear} * model.stat.extent;
  description.far = double{model.vis.map.zfar} * model.stat.extent;
  return description;
}

/// Returns the camera's optical frame in the world: x to the right, y down, z forward.
Pose optical_frame(const mjvScene& scene) {
  const mjvGLCamera& left_eye = scene.camera[0];
  const mjvGLCamera& right_eye = scene.camera[1];
  Vector3 position{};
  Vector3 forward{};
  Vector3 up{};
  for (std::size_t k = 0; k < 3; ++k) {
    position[k] = (double{left_eye.pos[k]} + double{right_eye.pos[k]}) / 2;
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
  return to_pose(position.data(), quaternion.data());
}

// ---------------------------------------------------------------- drawing

constexpr int kColors = 3;

/// Calls the function in a new thread in which the context is current.
/// @throws std::runtime_error as `refuse_pictures_in_fork`
template <typename Function>
void call_with(OffscreenContext& context, const Function& function) {
  refuse_pictures_in_fork();
  std::async(std::launch::async, [&] {
    context.make_current();
    try {
      function();
    } catch (...) {
      context.release();
      throw;
    }
    context.release();
  }).get();
}

/// MuJoCo's scene, off-screen buffer and OpenGL resources of a model.
class RenderContext {
 public:
  // Creates the context in a new thread, because EGL stores the bound API per thread.
  RenderContext(const mjModel& model, int max_geom)
      : context_(std::async(std::launch::async, make_offscreen_context).get()) {
    mjv_defaultScene(&scene_);
    mjr_defaultContext(&render_context_);
    mjv_makeScene(&model, &scene_, max_geom);
    try {
      call_with(*context_, [&] {
        mjr_makeContext(&model, &render_context_, mjFONTSCALE_150);
        mjr_setBuffer(mjFB_OFFSCREEN, &render_context_);
      });
    } catch (...) {
      mjv_freeScene(&scene_);
      throw;
    }
  }

  RenderContext(const RenderContext&) = delete;
  RenderContext& operator=(const RenderContext&) = delete;

  ~RenderContext() {
    try {
      call_with(*context_, [this] { mjr_freeContext(&render_context_); });
      // NOLINTNEXTLINE(bugprone-empty-catch): then the context's end frees it
    } catch (const std::exception&) {
    }
    // NOLINTNEXTLINE(bugprone-unused-return-value): after a fork it is the parent's
    if (has_drawn_before_fork()) static_cast<void>(context_.release());
    mjv_freeScene(&scene_);
  }

  mjvScene& scene() { return scene_; }

  /// @param color, depth receive rows from bottom to top; null: not wanted
  void draw(const mjrRect& viewport, unsigned char* color, float* depth) {
    call_with(*context_, [&] {
      mjr_render(viewport, &scene_, &render_context_);
      mjr_readPixels(color, depth, viewport, &render_context_);
    });
  }

 private:
  std::unique_ptr<OffscreenContext> context_;
  mjvScene scene_{};
  mjrContext render_context_{};
};

template <typename Value>
void turn_upside_down(std::vector<Value>& rows, std::size_t width) {
  const auto begin = [&](std::size_t row) {
    return rows.begin() + static_cast<std::ptrdiff_t>(row * width);
  };
  const std::size_t height = rows.size() / width;
  for (std::size_t row = 0; row < height / 2; ++row) {
    std::swap_ranges(begin(row), begin(row + 1), begin(height - 1 - row));
  }
}

// ---------------------------------------------------------------- levels

/// The extent along y of a level's ground [m]. It begins between the tracking camera and the
/// walker, and ends near the horizon.
constexpr std::array<double, 2> kGroundDepth{-1, 30};

/// Obstacles are a little larger than the ground, against flicker.
constexpr double kMargin = 0.002;  // [m]

/// Adds a box whose upper side is the line between two points of the x,z plane.
void add_box(const std::array<double, 2>& from, const std::array<double, 2>& to, double thickness,
             double margin, const Color& color, mjvScene& scene) {
  if (scene.ngeom >= scene.maxgeom) return;
  const double x = to[0] - from[0];
  const double z = to[1] - from[1];
  const double length = std::sqrt(x * x + z * z);
  if (length == 0) return;
  const auto [near, far] = kGroundDepth;
  const std::array<mjtNum, 3> size{length / 2 + margin, (far - near) / 2 + margin,
                                   thickness / 2 + margin};
  const std::array<mjtNum, 3> position{(from[0] + to[0]) / 2 + z / length * thickness / 2,
                                       (near + far) / 2,
                                       (from[1] + to[1]) / 2 - x / length * thickness / 2};
  const std::array<mjtNum, 9> rotation{x / length, 0, -z / length, 0, 1, 0,  //
                                       z / length, 0, x / length};
  std::array<float, 4> rgba{};
  // The scene's colours are those of unlit surfaces; the models' light comes from above.
  constexpr double kShade = 0.7;
  constexpr float kEmission = 0.4F;
  std::transform(color.begin(), color.begin() + 3, rgba.begin(),
                 [](double value) { return static_cast<float>(kShade * value); });
  rgba[3] = 1;
  mjvGeom& geom = scene.geoms[scene.ngeom++];
  mjv_initGeom(&geom, mjGEOM_BOX, size.data(), position.data(), rotation.data(), rgba.data());
  geom.category = mjCAT_STATIC;  // casts shadows
  geom.emission = kEmission;
  geom.specular = 0;
}

/// Adds a piece of the ground: a slope as a thin box, above an upright one.
void add_ground(const ScenePolygon& ground, const Color& surface, mjvScene& scene) {
  constexpr double kCrust = 0.02;  // [m]
  const std::array<double, 2>& from = ground.points[0];
  const std::array<double, 2>& to = ground.points[1];
  const double bottom = ground.points[2][1];
  const double low = std::min(from[1], to[1]);
  const bool is_level = from[1] == to[1];
  const bool is_wall = std::abs(to[1] - from[1]) > 4 * (to[0] - from[0]);
  if (!is_level && !is_wall) add_box(from, to, kCrust, 0, surface, scene);
  const double top = is_level ? low : low - kCrust;
  add_box({from[0], top}, {to[0], top}, top - bottom, 0, is_level ? surface : ground.color, scene);
}

/// Adds ground and obstacles around the walker, up to the number of shapes that the scene takes.
void add_level(const Scene& level, double x, mjvScene& scene) {
  constexpr double kShown = 25;  // on each side of the walker [m]
  const auto is_shown = [x](const ScenePolygon& polygon) {
    return polygon.points[0][0] < x + kShown && polygon.points[1][0] > x - kShown;
  };
  for (const ScenePolygon& obstacle : level.obstacles) {
    if (!is_shown(obstacle)) continue;
    const auto& corners = obstacle.points;  // the lower two first
    add_box(corners[3], corners[2], corners[3][1] - corners[0][1], kMargin, obstacle.color, scene);
  }
  for (std::size_t i = 0; i < level.ground.size(); ++i) {
    if (is_shown(level.ground[i])) add_ground(level.ground[i], level.surface_colors[i], scene);
  }
}

class MujocoRenderer : public Renderer {
 public:
  MujocoRenderer(const PlanarModel& model, std::string robot, const Parameters& camera)
      : robot_(std::move(robot)),
        model_(load_planar_model(model)),
        layout_(*model_),
        chosen_(choose_camera(*model_, camera)),
        camera_(describe_camera(*model_, chosen_, camera)),
        max_geom_(static_cast<int>(value_of<std::int64_t>(camera, "max_geom"))) {}

  const Camera& camera() const override { return camera_; }

  void render(const StateCapture& captured, const Channels& channels, Image& image) override {
    get_ready();
    pose(captured.sensors);
    mjvOption options;
    mjv_defaultOption(&options);
    const bool has_level = !captured.scene.ground.empty();
    if (has_level) lower_floor(captured.scene);
    mjv_updateScene(model_.get(), data_.get(), &options, nullptr, &chosen_, mjCAT_ALL,
                    &context_->scene());
    if (has_level) {
      add_level(captured.scene, captured.sensors.link_poses.front().position[0], context_->scene());
    }
    image.camera_pose = optical_frame(context_->scene());
    image.width = camera_.width;
    image.height = camera_.height;
    const std::size_t pixels = std::size_t{image.width} * image.height;
    image.rgb.resize(channels.color ? pixels * kColors : 0);
    image.depth.resize(channels.depth ? pixels : 0);
    if (!channels.color && !channels.depth) return;
    // Shadows and reflections are half of a picture's work and do not affect its depth.
    context_->scene().flags[mjRND_SHADOW] = channels.color ? 1 : 0;
    context_->scene().flags[mjRND_REFLECTION] = channels.color ? 1 : 0;
    const mjrRect viewport{0, 0, static_cast<int>(image.width), static_cast<int>(image.height)};
    context_->draw(viewport, channels.color ? image.rgb.data() : nullptr,
                   channels.depth ? image.depth.data() : nullptr);
    turn_upside_down(image.rgb, std::size_t{image.width} * kColors);
    turn_upside_down(image.depth, image.width);
    for (float& depth : image.depth) depth = to_meters(depth);
  }

 private:
  void get_ready() {
    if (context_) return;
    data_.reset(mj_makeData(model_.get()));
    if (!data_) throw std::runtime_error("MuJoCo could not allocate the picture's state");
    // A shallow copy: the model is shared, and its off-screen buffer may be too small.
    mjModel sized = *model_;
    sized.vis.global.offwidth =
        std::max(sized.vis.global.offwidth, static_cast<int>(camera_.width));
    sized.vis.global.offheight =
        std::max(sized.vis.global.offheight, static_cast<int>(camera_.height));
    context_.emplace(sized, max_geom_);
  }

  /// Sets the renderer's robot to the measured pose.
  /// @throws std::invalid_argument if the sensors are of another kind of robot or not finite
  void pose(const Sensors& sensors) {
    if (sensors.joint_position.size() != layout_.joints.size() || sensors.link_poses.empty()) {
      throw std::invalid_argument("instant with " + std::to_string(sensors.joint_position.size()) +
                                  " joints and " + std::to_string(sensors.link_poses.size()) +
                                  " links: not one of " + robot_);
    }
    const Pose& trunk = sensors.link_poses.front();
    write_base_position(*model_, trunk.position, trunk.orientation, data_->qpos);
    for (std::size_t i = 0; i < layout_.joints.size(); ++i) {
      data_->qpos[model_->jnt_qposadr[layout_.joints[i]]] = sensors.joint_position[i];
    }
    if (!std::all_of(data_->qpos, data_->qpos + model_->nq,
                     [](double value) { return std::isfinite(value); })) {
      throw std::invalid_argument("instant with a number that is not finite");
    }
    mj_kinematics(model_.get(), data_.get());
    mj_comPos(model_.get(), data_.get());
    mj_camlight(model_.get(), data_.get());
    mj_tendon(model_.get(), data_.get());
  }

  /// Moves the model's floor to the lower end of a level's ground.
  void lower_floor(const Scene& scene) {
    const int floor = floor_of(*model_);
    if (floor >= 0) data_->geom_xpos[3 * floor + 2] = scene.ground.front().points[2][1];
  }

  /// Inverts the formula of OpenGL's depth buffer.
  float to_meters(float buffer) const {
    return static_cast<float>(camera_.near /
                              (1 - double{buffer} * (1 - camera_.near / camera_.far)));
  }

  std::string robot_;
  ModelPointer model_;
  Layout layout_;
  mjvCamera chosen_;
  Camera camera_;
  int max_geom_;
  DataPointer data_;  // null before the first picture, like context_
  std::optional<RenderContext> context_;
};

}  // namespace

std::vector<ParameterDescription> camera_parameters(double distance) {
  constexpr double kFar = 1e6;
  constexpr double kTurn = 360;
  constexpr std::int64_t kSize = 480;
  return {
      {"width", kSize, "pixels", "Width of the image.", 1, kMaxPixels},
      {"height", kSize, "pixels", "Height of the image.", 1, kMaxPixels},
      {"camera_id", std::int64_t{-1}, "", "Index of a camera of the model; -1: by camera_name.", -1,
       std::numeric_limits<std::int32_t>::max()},
      {"camera_name", std::string(kTrackingCamera), "",
       "Name of a camera of the model; empty, or track if the model has no such camera: a free "
       "camera, set by distance, lookat, elevation and azimuth.",
       0, 0},
      {"distance", distance, "m", "Distance of the free camera from lookat.", 1e-3, kFar},
      {"lookat", std::vector<double>{0, 0, 1.15}, "m", "Point at which the free camera looks.",
       -kFar, kFar},
      {"elevation", -20.0, "degrees", "Elevation of the free camera; negative: from above.", -90,
       90},
      {"azimuth", 90.0, "degrees", "Azimuth of the free camera; 90: along y.", -kTurn, kTurn},
      {"max_geom", std::int64_t{1000}, "", "Maximum number of shapes in an image.", 1, 1e6},
  };
}

std::unique_ptr<Renderer> make_renderer(const PlanarModel& model, const std::string& robot,
                                        const Parameters& camera) {
  return std::make_unique<MujocoRenderer>(model, robot, camera);
}

}  // namespace walker::mujoco
