#include "mujoco/planar_robot.h"

#include <algorithm>

#include "mujoco/planar_base.h"
#include "mujoco/sense.h"
#include "mujoco/specification.h"

namespace walker::mujoco {

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
      physics_(load_planar_model(options.model)),
      layout_(physics_.model()),
      specification_(make_specification(options, layout_, physics_.model())),
      first_position_(model().nq),
      velocity_before_step_(model().nv) {}

void PlanarRobot::reset(std::optional<std::uint64_t> seed, Result& result) {
  if (seed) {
    generator_.emplace(*seed);
  } else if (!generator_) {
    generator_.emplace(draw_seed());
  }
  // The order of draws is Gymnasium's: positions, velocities.
  draw_noise(first_position_);
  draw_noise(velocity_before_step_);
  std::transform(first_position_.begin(), first_position_.end(), model().qpos0,
                 first_position_.begin(), std::plus<>());
  physics_.reset(first_position_.data(), velocity_before_step_.data());
  result = {result.observation, result.info};
  write_observation(model(), options_, position(), velocity(), result.observation);
  std::fill_n(result.info, specification_.info_names.size(),
              std::numeric_limits<double>::quiet_NaN());
  write_reset_info(result.info);
}

void PlanarRobot::draw_noise(std::vector<double>& noise) {
  const double scale = options_.reset_noise_scale;
  for (double& value : noise) value = generator_->uniform(-scale, scale);
}

void PlanarRobot::step(const double* action, std::size_t /*size*/, Result& result) {
  const double x_before = position()[kBaseX];
  std::copy_n(velocity(), model().nv, velocity_before_step_.begin());
  physics_.step(action, options_.frame_skip);
  result = {result.observation, result.info};
  write_observation(model(), options_, position(), velocity(), result.observation);
  conclude_step(action, (position()[kBaseX] - x_before) / specification_.dt, result);
}

void PlanarRobot::sense(Sensors& sensors) {
  physics_.measure();
  mujoco::sense(model(), physics_.data(), layout_, sensors);
  sense_motion(physics_.data(), velocity_before_step_.data(), specification_.dt, sensors);
}

void PlanarRobot::scene(Scene& scene) const { describe_scene(model(), physics_.data(), scene); }

GeneratorState PlanarRobot::generator_state() const {
  return generator_ ? generator_->state() : GeneratorState{};
}

}  // namespace walker::mujoco
