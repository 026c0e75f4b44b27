#include "robots/mujoco/renderer.h"

#include <algorithm>
#include <cmath>
#include <future>
#include <optional>
#include <stdexcept>
#include <utility>

#include "robots/mujoco/camera.h"
#include "robots/mujoco/layout.h"
#include "robots/mujoco/offscreen_context.h"
#include "robots/mujoco/planar_base.h"

namespace walker::mujoco {
namespace {

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
class Studio {
 public:
  // Creates the context in a new thread, because EGL stores the bound API per thread.
  Studio(const mjModel& model, int max_geom)
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

  Studio(const Studio&) = delete;
  Studio& operator=(const Studio&) = delete;

  ~Studio() {
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

class MujocoRenderer : public Renderer {
 public:
  MujocoRenderer(const PlanarModel& model, std::string robot, const Parameters& camera)
      : robot_(std::move(robot)),
        model_(load_planar_model(model)),
        layout_(*model_),
        base_(*model_),
        chosen_(choose_camera(*model_, camera)),
        camera_(describe_camera(*model_, chosen_, camera)),
        max_geom_(static_cast<int>(std::get<std::int64_t>(camera.at("max_geom")))) {}

  const Camera& camera() const override { return camera_; }

  void render(const StateCapture& captured, const Channels& channels, Image& image) override {
    get_ready();
    pose(captured.sensors);
    mjvOption options;
    mjv_defaultOption(&options);
    mjv_updateScene(model_.get(), data_.get(), &options, nullptr, &chosen_, mjCAT_ALL,
                    &studio_->scene());
    image.camera_pose = optical_frame(studio_->scene());
    image.width = camera_.width;
    image.height = camera_.height;
    const std::size_t pixels = std::size_t{image.width} * image.height;
    image.rgb.resize(channels.color ? pixels * kColors : 0);
    image.depth.resize(channels.depth ? pixels : 0);
    if (!channels.color && !channels.depth) return;
    // Shadows and reflections are half of a picture's work and do not affect its depth.
    studio_->scene().flags[mjRND_SHADOW] = channels.color ? 1 : 0;
    studio_->scene().flags[mjRND_REFLECTION] = channels.color ? 1 : 0;
    const mjrRect viewport{0, 0, static_cast<int>(image.width), static_cast<int>(image.height)};
    studio_->draw(viewport, channels.color ? image.rgb.data() : nullptr,
                  channels.depth ? image.depth.data() : nullptr);
    turn_upside_down(image.rgb, std::size_t{image.width} * kColors);
    turn_upside_down(image.depth, image.width);
    for (float& depth : image.depth) depth = to_meters(depth);
  }

 private:
  void get_ready() {
    if (studio_) return;
    data_.reset(mj_makeData(model_.get()));
    if (!data_) throw std::runtime_error("MuJoCo could not allocate the picture's state");
    // A shallow copy: the model is shared, and its off-screen buffer may be too small.
    mjModel sized = *model_;
    sized.vis.global.offwidth =
        std::max(sized.vis.global.offwidth, static_cast<int>(camera_.width));
    sized.vis.global.offheight =
        std::max(sized.vis.global.offheight, static_cast<int>(camera_.height));
    studio_.emplace(sized, max_geom_);
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
    base_.locate(trunk.position, trunk.orientation, data_->qpos);
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

  /// Inverts the formula of OpenGL's depth buffer.
  float to_meters(float buffer) const {
    return static_cast<float>(camera_.near /
                              (1 - double{buffer} * (1 - camera_.near / camera_.far)));
  }

  std::string robot_;
  ModelPointer model_;
  Layout layout_;
  PlanarBase base_;
  mjvCamera chosen_;
  Camera camera_;
  int max_geom_;
  DataPointer data_;  // null before the first picture, like studio_
  std::optional<Studio> studio_;
};

}  // namespace

std::unique_ptr<Renderer> make_renderer(const PlanarModel& model, const std::string& robot,
                                        const Parameters& camera) {
  return std::make_unique<MujocoRenderer>(model, robot, camera);
}

}  // namespace walker::mujoco
