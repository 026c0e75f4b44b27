#include "robots/mujoco/planar_robot.h"

#include <algorithm>
#include <array>

#include "base/checks.h"
#include "base/engine_release.h"
#include "robots/mujoco/library_physics.h"
#include "robots/mujoco/model.h"
#include "robots/mujoco/planar_base.h"
#include "robots/mujoco/sense.h"
#include "robots/mujoco/specification.h"

namespace walker::mujoco {
namespace {

void check_coordinates(const char* name, const std::vector<double>& values, int size) {
  if (values.size() != static_cast<std::size_t>(size)) {
    throw std::invalid_argument(name + (" has " + std::to_string(values.size())) +
                                " values; must have " + std::to_string(size));
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    check_finite(name + ("[" + std::to_string(i) + "]"), values[i], "");
  }
}

std::unique_ptr<Physics> make_physics(const PlanarOptions& options) {
  ModelPointer model = load_planar_model(options.model);
  if (options.make_physics) return options.make_physics(std::move(model));
  return std::make_unique<LibraryPhysics>(std::move(model));
}

}  // namespace

void write_observation(const mjModel& model, const PlanarOptions& options, const double* position,
                       const double* velocity, double* observation) {
  const int first = options.exclude_current_positions_from_observation ? 1 : 0;
  double* const velocities = std::copy(position + first, position + model.nq, observation);
  const double limit = options.velocity_limit;
  std::transform(velocity, velocity + model.nv, velocities,
                 [limit](double v) { return std::clamp(v, -limit, limit); });
}

PlanarRobot::PlanarRobot(const PlanarOptions& options)
    : options_(options),
      physics_(make_physics(options)),
      layout_(model()),
      specification_(make_specification(options, layout_, model())),
      first_position_(model().nq),
      velocity_before_step_(model().nv) {
  specification_.engine_version += kSteppedBy + physics_->stepper();
}

void PlanarRobot::reset(Generator& generator, double* info) {
  // Draws in Gymnasium's order: positions, then velocities.
  draw_noise(generator, first_position_);
  draw_noise(generator, velocity_before_step_);
  std::transform(first_position_.begin(), first_position_.end(), model().qpos0,
                 first_position_.begin(), std::plus<>());
  physics_->reset(first_position_.data(), velocity_before_step_.data());
  write_first_info(info);
}

void PlanarRobot::write_first_info(double* info) const {
  std::fill_n(info, specification_.info_names.size(), std::numeric_limits<double>::quiet_NaN());
  write_reset_info(info);
}

void PlanarRobot::draw_noise(Generator& generator, std::vector<double>& noise) const {
  const double scale = options_.reset_noise_scale;
  for (double& value : noise) value = generator.uniform(-scale, scale);
}

void PlanarRobot::step(RobotStep& step) {
  remember_state();
  physics_->step(step.action, options_.frame_skip);
  finish_step(step);
}

void PlanarRobot::step_group(RobotStep* const* steps, std::size_t count) noexcept {
  const auto robot_of = [](const RobotStep& step) -> PlanarRobot& {
    return static_cast<PlanarRobot&>(*step.robot);
  };
  std::array<PhysicsCall, kMaxGroupSize> calls;
  for (std::size_t i = 0; i < count; ++i) {
    PlanarRobot& robot = robot_of(*steps[i]);
    robot.remember_state();
    calls[i].physics = robot.physics_.get();
    calls[i].control = steps[i]->action;
  }
  physics_->step_together(calls.data(), count, options_.frame_skip);
  for (std::size_t i = 0; i < count; ++i) {
    if (calls[i].failure) {
      steps[i]->failure = calls[i].failure;
    } else {
      robot_of(*steps[i]).finish_step(*steps[i]);
    }
  }
}

void PlanarRobot::observe(double* observation) const {
  write_observation(model(), options_, position(), velocity(), observation);
}

void PlanarRobot::remember_state() {
  x_before_step_ = position()[kBaseX];
  std::copy_n(velocity(), model().nv, velocity_before_step_.begin());
}

void PlanarRobot::finish_step(RobotStep& step) const {
  conclude_step((position()[kBaseX] - x_before_step_) / specification_.dt, step);
}

void PlanarRobot::sense(Sensors& sensors) {
  physics_->measure([&](const mjData& data) {
    mujoco::sense(model(), data, layout_, sensors);
    sense_motion(data, velocity_before_step_.data(), specification_.dt, sensors);
  });
}

void PlanarRobot::scene(Scene& scene) const {
  physics_->measure([&](const mjData& data) { describe_scene(model(), data, scene); });
}

std::uint64_t PlanarRobot::model_fingerprint() const {
  if (!model_fingerprint_) model_fingerprint_ = fingerprint(model());
  return *model_fingerprint_;
}

void PlanarRobot::save(StateWriter& writer) const {
  writer.number(model_fingerprint());
  writer.number(x_before_step_);
  writer.numbers(velocity_before_step_.data(), velocity_before_step_.size());
  std::vector<double> values(physics_->state_size());
  physics_->save(values.data());
  writer.numbers(values.data(), values.size());
}

std::function<void()> PlanarRobot::load(StateReader& reader) {
  if (reader.number<std::uint64_t>() != model_fingerprint()) {
    throw std::invalid_argument("the state is of another model than this " + specification_.id +
                                "; has a file changed that its parameters name?");
  }
  const auto x_before_step = reader.number<double>();
  std::vector<double> velocity_before_step(velocity_before_step_.size());
  reader.numbers(velocity_before_step.data(), velocity_before_step.size());
  std::vector<double> values(physics_->state_size());
  reader.numbers(values.data(), values.size());
  return [this, x_before_step, velocity_before_step, values] {
    x_before_step_ = x_before_step;
    velocity_before_step_ = velocity_before_step;
    physics_->load(values.data());
  };
}

void PlanarRobot::set_coordinates(const std::vector<double>& position,
                                  const std::vector<double>& velocity, double* info) {
  check_coordinates("qpos", position, model().nq);
  check_coordinates("qvel", velocity, model().nv);
  std::vector<double> state(physics_->state_size());
  physics_->save(state.data());
  std::copy(velocity.begin(), velocity.end(),
            std::copy(position.begin(), position.end(), state.begin()));
  forward(model(), state.data());
  physics_->load(state.data());
  velocity_before_step_ = velocity;
  write_first_info(info);
}

}  // namespace walker::mujoco
