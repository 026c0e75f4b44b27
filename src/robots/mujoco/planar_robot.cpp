#include "robots/mujoco/planar_robot.h"

#include <algorithm>
#include <array>

#include "base/checks.h"
#include "base/engine_release.h"
#include "base/link_parameters.h"
#include "base/range_finder.h"
#include "base/unwrapped_angle.h"
#include "robots/mujoco/model.h"
#include "robots/mujoco/physics.h"

namespace walker::mujoco {
namespace {

std::unique_ptr<Physics> make_physics(const PlanarOptions& options, ModelPointer model) {
  if (options.make_physics) return options.make_physics(std::move(model));
  return std::make_unique<LibraryPhysics>(std::move(model));
}

Pose pose_of_body(const mjData& data, int body) {
  return to_pose(at(data.xpos, body, 3), at(data.xquat, body, 4));
}

/// Whether the body, or one fixed to it, touches the static world.
bool touches_ground(const mjModel& model, const mjData& data, int body) {
  const auto carrier = [&model](int geom) { return carrier_of(model, model.geom_bodyid[geom]); };
  return std::any_of(data.contact, data.contact + data.ncon, [&](const mjContact& contact) {
    const int first = carrier(contact.geom1);
    const int second = carrier(contact.geom2);
    return contact.exclude == 0 &&
           ((first == body && second == 0) || (first == 0 && second == body));
  });
}

void sense_joints(const mjModel& model, const mjData& data, const Layout& layout,
                  Sensors& sensors) {
  const std::size_t num_joints = layout.joints.size();
  sensors.joint_position.resize(num_joints);
  sensors.joint_velocity.resize(num_joints);
  sensors.joint_effort.resize(num_joints);
  sensors.link_poses.resize(num_joints + 1);
  sensors.link_poses[0] = pose_of_body(data, layout.trunk);
  for (std::size_t i = 0; i < num_joints; ++i) {
    const int dof = model.jnt_dofadr[layout.joints[i]];
    sensors.joint_position[i] = data.qpos[model.jnt_qposadr[layout.joints[i]]];
    sensors.joint_velocity[i] = data.qvel[dof];
    sensors.joint_effort[i] = data.qfrc_actuator[dof];
    sensors.link_poses[i + 1] = pose_of_body(data, layout.limbs[i]);
  }
  sensors.contacts.resize(layout.feet.size());
  std::transform(layout.feet.begin(), layout.feet.end(), sensors.contacts.begin(),
                 [&](int foot) { return touches_ground(model, data, foot) ? 1 : 0; });
  sensors.gravity = to_vector3(model.opt.gravity);
}

void sense_motion(const mjData& data, const double* velocity_before_step, double dt,
                  Sensors& sensors) {
  for (std::size_t k = 0; k < 3; ++k) {
    const auto along = [&](int joint) { return at(data.xaxis, joint, 3)[k]; };
    const auto slide = [&](const double* v) {
      return v[kBaseX] * along(kBaseX) + v[kBaseZ] * along(kBaseZ);
    };
    sensors.linear_velocity[k] = slide(data.qvel);
    sensors.linear_acceleration[k] = (slide(data.qvel) - slide(velocity_before_step)) / dt;
    sensors.angular_velocity[k] = data.qvel[kBasePitch] * along(kBasePitch);
  }
}

/// Writes the positions, without the trunk's x if that is excluded, then the velocities.
/// @param position, velocity MuJoCo's qpos and qvel
/// @return the written velocities
double* write_state(const mjModel& model, const PlanarOptions& options, const double* position,
                    const double* velocity, double* observation) {
  const int first = options.exclude_current_positions_from_observation ? 1 : 0;
  double* const velocities = std::copy(position + first, position + model.nq, observation);
  std::copy_n(velocity, model.nv, velocities);
  return velocities;
}

/// @return the end of the velocities
double* clamp_velocities(const mjModel& model, const PlanarOptions& options, double* velocities) {
  const double limit = options.velocity_limit;
  return std::transform(velocities, velocities + model.nv, velocities,
                        [limit](double v) { return std::clamp(v, -limit, limit); });
}

/// Writes what `write_state` writes, with clamped velocities.
/// @return the end of what is written
double* write_observation(const mjModel& model, const PlanarOptions& options,
                          const double* position, const double* velocity, double* observation) {
  return clamp_velocities(model, options,
                          write_state(model, options, position, velocity, observation));
}

class Builder : public ObservationBuilder {
 public:
  explicit Builder(const PlanarOptions& options)
      : options_(options),
        model_(load_planar_model(options.model)),
        layout_(*model_),
        specification_(make_specification(options, layout_, *model_)),
        position_(model_->nq),
        velocity_(model_->nv) {}

  void reset() override { pitch_.reset(); }

  void build(const Measurements& measurements, double* observation) override {
    check_measurements(measurements, specification_);
    check_finite("position[0]", measurements.position[0], " m");
    check_finite("position[2]", measurements.position[2], " m");
    write_base_position(*model_, measurements.position, measurements.orientation, position_.data());
    const double start = model_->qpos0[kBasePitch];
    position_[kBasePitch] = start + pitch_.follow(position_[kBasePitch] - start);
    write_base_velocity(*model_, measurements, velocity_.data());
    for (std::size_t i = 0; i < layout_.joints.size(); ++i) {
      position_[model_->jnt_qposadr[layout_.joints[i]]] = measurements.joint_position[i];
      velocity_[model_->jnt_dofadr[layout_.joints[i]]] = measurements.joint_velocity[i];
    }
    double* const end =
        write_observation(*model_, options_, position_.data(), velocity_.data(), observation);
    if (!options_.include_lidar_in_observation) return;
    const std::vector<double>& ranges = measurements.ranges;
    write_fractions(ranges.data(), ranges.size(),
                    maximum_range_of(measurements, specification_.range_finder), end);
  }

 private:
  PlanarOptions options_;
  ModelPointer model_;
  Layout layout_;
  Specification specification_;
  UnwrappedAngle pitch_;
  std::vector<double> position_;  // MuJoCo's qpos
  std::vector<double> velocity_;  // MuJoCo's qvel
};

}  // namespace

std::unique_ptr<ObservationBuilder> make_observation_builder(const PlanarOptions& options) {
  return std::make_unique<Builder>(options);
}

PlanarRobot::PlanarRobot(const PlanarOptions& options)
    : options_(options),
      models_(load_planar_model(options.model)),
      level_refusal_(shared_by_users_of<LevelRefusal>(models_.base())),
      physics_(make_physics(options, models_.base())),
      layout_(model()),
      specification_(make_specification(options, layout_, model())),
      lidar_range_(options.lidar_range),
      first_position_(model().nq),
      velocity_before_step_(model().nv) {
  specification_.engine_version += kSteppedBy + physics_->stepper();
  const auto refuse = [&](const std::string& parameter, const std::string& reason) {
    specification_.inapplicable_world_parameters.emplace_back(
        parameter, describe_model(options.model.xml_file) + reason);
  };
  const std::vector<Link>& links = specification_.links;
  for (const std::string& body : options.bodies) {
    if (mj_name2id(&model(), mjOBJ_BODY, body.c_str()) < 0) {
      refuse(mass_name(body), "the model has no body " + body);
    }
    const auto has_name = [&body](const Link& link) { return link.name == body; };
    if (std::any_of(links.begin(), links.end(), has_name)) continue;
    for (const char axis : {'x', 'z'})
      refuse(force_name(body, axis), "the model has no link " + body);
  }
  if (floor_of(model()) < 0) refuse(kFloorFriction, level_refusal_->text);
  if (level_refusal_->text.empty()) return;
  for (const WorldParameter& parameter : level_parameters()) {
    refuse(parameter.name, level_refusal_->text);
  }
}

void PlanarRobot::set_world(const WorldValues& values) {
  level_ = level_of(values);
  change_physics(values);
  if (!level_) set_ground({}, nullptr);
  lidar_range_ = value_or(values, "lidar_range", options_.lidar_range);
}

void PlanarRobot::change_physics(const WorldValues& values) {
  physics_->set_model(models_.model_of(physics_of(values)));
}

void PlanarRobot::set_ground(const GeneratorState& origin,
                             std::shared_ptr<const LevelGround> ground) {
  ground_origin_ = origin;
  ground_ = std::move(ground);
  physics_->set_ground(line());
}

std::shared_ptr<const LevelGround> PlanarRobot::draw_ground(Generator& generator,
                                                            const Level& level) const {
  const mjModel& base = *models_.base();
  const Point origin{at(base.body_pos, layout_.trunk, 3)[0],
                     at(base.geom_pos, floor_of(base), 3)[2]};
  return std::make_shared<LevelGround>(generator, level, origin);
}

void PlanarRobot::reset(Generator& generator, double* info) {
  if (level_) {
    const GeneratorState origin = generator.state();
    set_ground(origin, draw_ground(generator, *level_));
  }
  const double scale = options_.reset_noise_scale;
  // Draws in Gymnasium's order: positions, then velocities.
  for (std::size_t i = 0; i < first_position_.size(); ++i) {
    first_position_[i] = generator.uniform(-scale, scale) + model().qpos0[i];
  }
  for (double& velocity : velocity_before_step_) velocity = generator.uniform(-scale, scale);
  physics_->reset(first_position_.data(), velocity_before_step_.data());
  write_first_info(info);
}

void PlanarRobot::write_first_info(double* info) const {
  std::fill_n(info, specification_.info_names.size(), std::numeric_limits<double>::quiet_NaN());
  write_reset_info(info);
}

void PlanarRobot::step(RobotStep& step) {
  remember_state();
  physics_->step(step.action, forces_of(step), options_.frame_skip);
  finish_step(step);
}

void PlanarRobot::step_group(RobotStep* const* steps, std::size_t count) noexcept {
  const auto robot_of = [](const RobotStep& step) -> PlanarRobot& {
    return static_cast<PlanarRobot&>(*step.robot);
  };
  std::array<PhysicsCall, kMaxGroupSize> calls;
  std::array<RobotStep*, kMaxGroupSize> members;
  std::size_t num_calls = 0;
  for (RobotStep* const* step = steps; step != steps + count; ++step) {
    if ((*step)->generator != nullptr) {
      Robot::step_group(step, 1);
      continue;
    }
    PlanarRobot& robot = robot_of(**step);
    robot.remember_state();
    calls[num_calls].physics = robot.physics_.get();
    calls[num_calls].control = (*step)->action;
    calls[num_calls].forces = robot.forces_of(**step);
    members[num_calls++] = *step;
  }
  if (num_calls != 0) physics_->step_together(calls.data(), num_calls, options_.frame_skip);
  for (std::size_t i = 0; i < num_calls; ++i) {
    RobotStep& step = *members[i];
    if (calls[i].failure) {
      step.failure = calls[i].failure;
    } else {
      robot_of(step).finish_step(step);
    }
  }
}

void PlanarRobot::observe(double* observation) const {
  double* const end = write_observation(model(), options_, position(), velocity(), observation);
  if (!options_.include_lidar_in_observation) return;
  const LidarRanges ranges = cast_rays();
  write_fractions(ranges.data(), ranges.size(), lidar_range_, end);
}

LidarRanges PlanarRobot::cast_rays(const mjData* data) const {
  return cast_lidar(model(), data, base_origin(model(), position()), lidar_range_, line());
}

LidarRanges PlanarRobot::cast_rays() const {
  if (!needs_data(model())) return cast_rays(nullptr);
  LidarRanges ranges;
  physics_->measure([&](const mjData& data) { ranges = cast_rays(&data); });
  return ranges;
}

/// Adds the noise to the coordinates, because the trunk's joints are the world's x, z and pitch,
/// and clamps the sums, as `Builder` does. The trunk's position has no noise.
void PlanarRobot::observe(const SensorNoise& noise, double* observation) const {
  double* const velocities = write_state(model(), options_, position(), velocity(), observation);
  double* const positions_end = velocities;
  const auto position_at = [&](int i) -> double& { return positions_end[i - model().nq]; };
  position_at(kBasePitch) += noise.pitch;
  velocities[kBaseX] += noise.linear_velocity[0];
  velocities[kBaseZ] += noise.linear_velocity[1];
  velocities[kBasePitch] += noise.angular_velocity;
  for (std::size_t i = 0; i < layout_.joints.size(); ++i) {
    position_at(model().jnt_qposadr[layout_.joints[i]]) += noise.joint_position[i];
    velocities[model().jnt_dofadr[layout_.joints[i]]] += noise.joint_velocity[i];
  }
  double* const end = clamp_velocities(model(), options_, velocities);
  if (!options_.include_lidar_in_observation) return;
  LidarRanges ranges = cast_rays();
  add_range_noise(noise.ranges, lidar_range_, ranges.data());
  write_fractions(ranges.data(), ranges.size(), lidar_range_, end);
}

GroundBelow PlanarRobot::ground_below() const {
  if (!ground_) return {};
  return ground_->below(position()[kBaseX] - model().qpos0[kBaseX]);
}

void PlanarRobot::remember_state() {
  x_before_step_ = position()[kBaseX];
  std::copy_n(velocity(), model().nv, velocity_before_step_.begin());
}

/// The result refers to `wrenches_`.
ExternalForces PlanarRobot::forces_of(const RobotStep& step) {
  ExternalForces forces;
  forces.trunk = {step.push[0] / specification_.dt, step.push[1] / specification_.dt};
  if (step.wrenches.empty() && step.forces == nullptr) return forces;
  wrenches_.clear();
  const auto add = [this](const std::vector<LinkWrench>& wrenches) {
    for (const LinkWrench& wrench : wrenches) {
      const int body = wrench.link == 0 ? layout_.trunk : layout_.limbs[wrench.link - 1];
      wrenches_.push_back({body, {wrench.force_x, 0, wrench.force_z}, {0, wrench.torque_y, 0}});
    }
  };
  add(step.wrenches);
  if (step.forces != nullptr) add(*step.forces);
  forces.wrenches = &wrenches_;
  return forces;
}

void PlanarRobot::finish_step(RobotStep& step) const {
  conclude_step((position()[kBaseX] - x_before_step_) / specification_.dt, step);
}

void PlanarRobot::sense(Sensors& sensors) {
  physics_->measure([&](const mjData& data) {
    sense_joints(model(), data, layout_, sensors);
    sense_motion(data, velocity_before_step_.data(), specification_.dt, sensors);
    const LidarRanges ranges = cast_rays(&data);
    sensors.ranges.assign(ranges.begin(), ranges.end());
  });
  sensors.maximum_range = lidar_range_;
}

void PlanarRobot::scene(Scene& scene) const {
  if (ground_) {
    ground_->describe(scene);
    return;
  }
  scene = {};
  const int* const geoms = model().geom_type;
  const auto plane = std::find(geoms, geoms + model().ngeom, mjGEOM_PLANE) - geoms;
  if (plane == model().ngeom) return;
  physics_->measure([&](const mjData& data) {
    scene.floor = Floor{at(data.geom_xpos, static_cast<int>(plane), 3)[2], kTile, kTileColors};
  });
}

std::uint64_t PlanarRobot::model_fingerprint() const {
  if (!model_fingerprint_) model_fingerprint_ = fingerprint(*models_.base());
  return *model_fingerprint_;
}

void PlanarRobot::save(StateWriter& writer) const {
  writer.number(model_fingerprint());
  writer.number(x_before_step_);
  writer.numbers(velocity_before_step_.data(), velocity_before_step_.size());
  std::vector<double> values(physics_->state_size());
  physics_->save(values.data());
  writer.numbers(values.data(), values.size());
  if (!level_) return;
  writer.number(std::uint8_t{ground_ != nullptr});
  if (ground_) writer.numbers(ground_origin_.data(), ground_origin_.size());
}

std::function<void()> PlanarRobot::load(StateReader& reader, const WorldValues& values,
                                        bool is_alive) {
  if (reader.number<std::uint64_t>() != model_fingerprint()) {
    throw std::invalid_argument("the state is of another model than this " + specification_.id +
                                "; has a file changed that its parameters name?");
  }
  const auto x_before_step = reader.finite_number<double>("the position before the step");
  std::vector<double> velocity_before_step(velocity_before_step_.size());
  reader.finite_numbers(velocity_before_step.data(), velocity_before_step.size(),
                        "velocities before the step");
  std::vector<double> state(physics_->state_size());
  reader.finite_numbers(state.data(), state.size(), "MuJoCo's state");
  const ModelPointer model = models_.model_of(physics_of(values));
  const double lidar_range = value_or(values, "lidar_range", options_.lidar_range);
  const std::optional<Level> level = level_of(values);
  GeneratorState origin{};
  std::shared_ptr<const LevelGround> ground;
  if (level && reader.flag()) {
    reader.numbers(origin.data(), origin.size());
    ground = ground_;
    if (!ground_ || level_ != level || origin != ground_origin_) {
      Generator generator(origin);
      ground = draw_ground(generator, *level);
    }
  }
  if (is_alive && level && !ground) refuse_state("its level has no course");
  return [this, model, level, origin, ground, lidar_range, x_before_step, velocity_before_step,
          state] {
    lidar_range_ = lidar_range;
    x_before_step_ = x_before_step;
    velocity_before_step_ = velocity_before_step;
    level_ = level;
    physics_->set_model(model);
    set_ground(origin, ground);
    // Without a ground the next call is `reset`.
    if (!level || ground) physics_->load(state.data());
  };
}

void PlanarRobot::set_coordinates(const std::vector<double>& position,
                                  const std::vector<double>& velocity, double* info) {
  std::vector<double> state(physics_->state_size());
  physics_->save(state.data());
  std::copy(velocity.begin(), velocity.end(),
            std::copy(position.begin(), position.end(), state.begin()));
  forward(model(), line(), state.data());
  physics_->load(state.data());
  velocity_before_step_ = velocity;
  write_first_info(info);
}

}  // namespace walker::mujoco
