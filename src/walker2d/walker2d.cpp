#include "walker2d/walker2d.h"

#include <algorithm>
#include <limits>

#include "walker2d/model.h"
#include "walker2d/observation.h"
#include "walker2d/specification.h"

namespace walker::walker2d {

Walker2d::Walker2d(const Options& options)
    : options_(options),
      physics_(load_model(options.xml_file)),
      layout_(physics_.model()),
      specification_(make_specification(options, layout_, physics_.model())) {}

void Walker2d::reset(std::optional<std::uint64_t> seed, Result& result) {
  if (seed) {
    generator_.emplace(*seed);
  } else if (!generator_) {
    generator_.emplace(draw_seed());
  }
  // The order of draws is Gymnasium's: positions, velocities.
  State position = draw_noise();
  const State velocity = draw_noise();
  for (int i = 0; i < kDegreesOfFreedom; ++i) position[i] += physics_.model().qpos0[i];
  physics_.reset(position.data(), velocity.data());
  velocity_before_step_ = velocity;
  observe(result.observation);
  std::fill_n(result.info, specification_.info_names.size(),
              std::numeric_limits<double>::quiet_NaN());
  if (options_.is_v5) tell_state(result.info);
  result.reward = 0;
  result.terminated = false;
  result.truncated = false;
  result.end_reason = "";
  result.error = "";
}

Walker2d::State Walker2d::draw_noise() {
  State noise{};
  for (double& value : noise) {
    value = generator_->uniform(-options_.reset_noise_scale, options_.reset_noise_scale);
  }
  return noise;
}

void Walker2d::step(const double* action, std::size_t /*size*/, Result& result) {
  const double x_before = physics_.data().qpos[kRootX];
  std::copy_n(physics_.data().qvel, kDegreesOfFreedom, velocity_before_step_.begin());
  physics_.step(action, options_.frame_skip);
  const double x_velocity = (physics_.data().qpos[kRootX] - x_before) / specification_.dt;
  const char* const illness = why_unhealthy();
  const bool is_healthy = illness[0] == '\0';
  observe(result.observation);
  score(action, x_velocity, is_healthy, result);
  result.terminated = !is_healthy && options_.reward.terminate_when_unhealthy;
  result.truncated = false;
  result.end_reason = result.terminated ? illness : "";
  result.error = "";
}

void Walker2d::observe(double* observation) const {
  write_observation(physics_.data().qpos, physics_.data().qvel,
                    options_.exclude_current_positions_from_observation, observation);
}

void Walker2d::tell_state(double* info) const {
  const mjtNum* const position = physics_.data().qpos;
  info[kPositionX] = position[kRootX];
  info[kDistanceZ] = position[kRootZ] - physics_.model().qpos0[kRootZ];
}

void Walker2d::score(const double* action, double x_velocity, bool is_healthy,
                     Result& result) const {
  const RewardTerms terms = reward_of_step(options_.reward, x_velocity, is_healthy, action);
  result.reward = terms.total();
  if (options_.is_v5) {
    tell_state(result.info);
    result.info[kVelocityX] = x_velocity;
    result.info[kRewardForward] = terms.forward;
    result.info[kRewardControl] = terms.control;
    result.info[kRewardSurvive] = terms.survive;
  } else {
    result.info[0] = physics_.data().qpos[kRootX];
    result.info[1] = x_velocity;
  }
}

/// Static text; empty when the walker is healthy.
const char* Walker2d::why_unhealthy() const {
  const mjtNum* const position = physics_.data().qpos;
  const auto is_within = [](const std::array<double, 2>& range, double value) {
    return range[0] < value && value < range[1];
  };
  if (!is_within(options_.healthy_z_range, position[kRootZ])) {
    return "the torso's height left healthy_z_range";
  }
  if (!is_within(options_.healthy_angle_range, position[kRootPitch])) {
    return "the torso's angle left healthy_angle_range";
  }
  return "";
}

void Walker2d::sense(Sensors& sensors) {
  physics_.measure();
  sensors.joint_position.resize(kJointCount);
  sensors.joint_velocity.resize(kJointCount);
  sensors.joint_effort.resize(kJointCount);
  sensors.link_poses.resize(kJointCount + 1);
  sensors.contacts.resize(layout_.feet.size());
  const mjModel& model = physics_.model();
  const mjData& data = physics_.data();

  sensors.link_poses[0] = pose_of_body(data, layout_.trunk);
  for (int i = 0; i < kJointCount; ++i) {
    const int dof = model.jnt_dofadr[layout_.joints[i]];
    sensors.joint_position[i] = data.qpos[model.jnt_qposadr[layout_.joints[i]]];
    sensors.joint_velocity[i] = data.qvel[dof];
    sensors.joint_effort[i] = data.qfrc_actuator[dof];
    sensors.link_poses[i + 1] = pose_of_body(data, layout_.limbs[i]);
  }

  sensors.gravity = to_vector3(model.opt.gravity);
  for (std::size_t k = 0; k < 3; ++k) {
    const auto along = [&](int joint) { return at(data.xaxis, joint, 3)[k]; };
    const auto slide = [&](const double* v) {
      return v[kRootX] * along(kRootX) + v[kRootZ] * along(kRootZ);
    };
    sensors.linear_velocity[k] = slide(data.qvel);
    sensors.linear_acceleration[k] =
        (slide(data.qvel) - slide(velocity_before_step_.data())) / specification_.dt;
    sensors.angular_velocity[k] = data.qvel[kRootPitch] * along(kRootPitch);
  }

  std::transform(layout_.feet.begin(), layout_.feet.end(), sensors.contacts.begin(),
                 [&](int foot) { return touches_ground(model, data, foot) ? 1 : 0; });
}

void Walker2d::scene(Scene& scene) const {
  describe_scene(physics_.model(), physics_.data(), scene);
}

GeneratorState Walker2d::generator_state() const {
  return generator_ ? generator_->state() : GeneratorState{};
}

void Walker2d::set_generator_state(const GeneratorState& state) { generator_.emplace(state); }

}  // namespace walker::walker2d
