#include "robots/bipedal_walker/bipedal_walker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

namespace walker::bipedal_walker {
namespace {

/// Gymnasium's reset ends with a step of this action and discards its reward and flags.
constexpr std::array<double, kJointCount> kNoTorque{};

/// Computes the arm in the body's frame. Box2D's own function subtracts two world positions, which
/// is inaccurate in single precision far from the origin.
b2Vec2 velocity_of_origin(const b2Body& body) {
  return body.GetLinearVelocity() -
         b2Cross(body.GetAngularVelocity(), body.GetWorldVector(body.GetLocalCenter()));
}

/// Gymnasium's shaped reward of a step: 130 / 30 per metre of progress (about 300 to the far end),
/// minus 5 per radian of added hull tilt, minus 0.028 per joint at full torque.
///
/// The difference of shapings is computed in double precision. The costs are then subtracted in
/// single precision, as with float32 actions under NumPy 2.
/// @param shaping the previous step's, empty in an episode's first step; receives this step's
float shaped_reward(const b2Body& hull, const double* action, std::optional<double>& shaping) {
  constexpr double kTorqueCost = 0.00035 * kMotorTorque;
  const auto before = std::exchange(shaping, 130 * double{hull.GetPosition().x} / kScale -
                                                 5.0 * std::abs(double{hull.GetAngle()}));
  float reward = before ? static_cast<float>(*shaping - *before) : 0.0F;
  for (std::size_t i = 0; i < kJointCount; ++i) {
    const float effort = std::min(std::abs(static_cast<float>(action[i])), 1.0F);
    reward -= static_cast<float>(kTorqueCost) * effort;
  }
  return reward;
}

}  // namespace

BipedalWalker::BipedalWalker(const std::string& id, const Parameters& parameters)
    : is_hardcore_(std::get<bool>(parameters.at("hardcore"))),
      reuses_world_(std::get<bool>(parameters.at("reuse_world"))) {
  const KernelChoice choice = choose_kernel();
  kernel_ = choice.kernel;
  specification_ = make_specification(
      id, parameters,
      kernel_ != nullptr ? std::string("the kernel for ") + kernel_->instruction_set
                         : "the library: " + choice.fallback_reason);
}

void BipedalWalker::set_world(const WorldValues& values) { next_world_ = settings_of(values); }

void BipedalWalker::change_physics(const WorldValues& values) {
  world_ = settings_of(values);
  physics_->change(world_.dynamics);
}

void BipedalWalker::reset(Generator& generator, double* /*info*/) {
  RobotStep reset;
  reset.generator = &generator;
  step(reset);
}

void BipedalWalker::step(RobotStep& step) {
  step.robot = this;
  RobotStep* const only = &step;
  step_group(&only, 1);
  if (step.failure) std::rethrow_exception(std::exchange(step.failure, nullptr));
}

void BipedalWalker::step_group(RobotStep* const* steps, std::size_t count) noexcept {
  const auto walker_of = [](const RobotStep& step) -> BipedalWalker& {
    return static_cast<BipedalWalker&>(*step.robot);
  };
  std::array<PhysicsCall, kMaxGroupSize> calls;
  std::array<RobotStep*, kMaxGroupSize> members;
  std::size_t num_calls = 0;
  for (RobotStep* const* each = steps; each != steps + count; ++each) {
    RobotStep& step = **each;
    BipedalWalker& walker = walker_of(step);
    if (walker.kernel_ != kernel_) {
      walker.step_group(each, 1);
      continue;
    }
    try {
      if (step.generator != nullptr) {
        walker.begin_episode(*step.generator);
        step.action = kNoTorque.data();
      }
      walker.begin_step(step);
    } catch (...) {
      walker.physics_.reset();
      step.failure = std::current_exception();
      continue;
    }
    calls[num_calls] = {&*walker.physics_, &step.failure};
    members[num_calls++] = &step;
  }
  if (kernel_ != nullptr) step_together(*kernel_, calls.data(), num_calls);
  for (std::size_t i = 0; i < num_calls; ++i) {
    RobotStep& step = *members[i];
    BipedalWalker& walker = walker_of(step);
    try {
      if (step.failure) std::rethrow_exception(step.failure);
      if (kernel_ == nullptr) walker.physics_->step();
      cast_lidar(*walker.physics_, walker.ground_, walker.world_.lidar_range, walker.lidar_);
      walker.finish_step(step);
    } catch (...) {
      // A failed assertion leaves the world locked. The next reset makes a new one.
      walker.physics_.reset();
      step.failure = std::make_exception_ptr(std::runtime_error("Box2D failed an assertion"));
    }
  }
}

/// Draws in Gymnasium's order: ground, clouds, push.
void BipedalWalker::begin_episode(Generator& generator) {
  world_ = next_world_;
  ground_origin_ = generator.state();
  ground_ = draw_ground(generator, is_hardcore_, world_.level);
  clouds_ = generate_clouds(generator);
  build_world(generator.uniform(-world_.initial_force, world_.initial_force), reuses_world_);
  shaping_.reset();
}

/// If this throws, there is no world.
void BipedalWalker::build_world(double push, bool reuse) {
  try {
    if (physics_ && reuse) {
      physics_->destroy();
    } else {
      physics_.emplace();
    }
    physics_->build(ground_, push, world_.dynamics);
  } catch (...) {
    physics_.reset();
    throw;
  }
}

void BipedalWalker::begin_step(const RobotStep& step) {
  velocity_before_step_ = velocity_of_origin(physics_->hull());
  physics_->drive(step.action);
  if (step.generator != nullptr) return;  // the step of a reset
  if (step.push[0] != 0 || step.push[1] != 0) physics_->push(step.push);
  for (const LinkWrench& wrench : step.wrenches) physics_->apply(wrench);
  if (step.forces == nullptr) return;
  for (const LinkWrench& force : *step.forces) physics_->apply(force);
}

void BipedalWalker::finish_step(RobotStep& step) {
  constexpr double kFarEnd = (kTerrainLength - kTerrainGrass) * kTerrainStep;
  const auto x = double{physics_->hull().GetPosition().x};
  step.reward = double{shaped_reward(physics_->hull(), step.action, shaping_)};
  if (physics_->hull_has_touched()) {
    step.end_reason = "hull touched the ground";
  } else if (x < 0) {
    step.end_reason = "hull left the terrain";
  } else {
    step.end_reason = x > kFarEnd ? "arrived at the far end" : "";
  }
  step.terminated = step.end_reason[0] != '\0';
  if (physics_->hull_has_touched() || x < 0) step.reward = kFallReward;
}

Observed BipedalWalker::observed() const {
  Observed observed = observed_in(*physics_);
  std::transform(lidar_.begin(), lidar_.end(), observed.ray_fraction.begin(),
                 [](const RayHit& ray) { return double{ray.fraction}; });
  return observed;
}

void BipedalWalker::observe(double* observation) const {
  write_observation(observed(), observation);
}

void BipedalWalker::observe(const SensorNoise& noise, double* observation) const {
  Observed noisy = observed();
  add(noise, physics_->hull().GetLocalCenter(), lidar_, world_.lidar_range, noisy);
  write_observation(noisy, observation);
}

void BipedalWalker::sense(Sensors& sensors) {
  sensors.joint_position.resize(kJointCount);
  sensors.joint_velocity.resize(kJointCount);
  sensors.joint_effort.resize(kJointCount);
  sensors.link_poses.resize(kJointCount + 1);
  sensors.ranges.resize(kLidarRays);
  sensors.contacts.resize(2);

  const b2Body& hull = physics_->hull();
  sensors.link_poses[0] = to_pose(hull.GetPosition(), hull.GetAngle());
  for (std::size_t i = 0; i < kJointCount; ++i) {
    const b2RevoluteJoint& joint = physics_->joint(i);
    sensors.joint_position[i] = double{joint.GetJointAngle()};
    sensors.joint_velocity[i] = double{joint.GetJointSpeed()};
    sensors.joint_effort[i] = double{joint.GetMotorTorque(static_cast<float>(kStepsPerSecond))};
    sensors.link_poses[i + 1] =
        to_pose(joint.GetAnchorB(), child_of(joint).GetAngle() - frame_rotation(*physics_, i));
  }

  const b2Vec2 velocity = velocity_of_origin(hull);
  const b2Vec2 acceleration =
      static_cast<float>(kStepsPerSecond) * (velocity - velocity_before_step_);
  const b2Vec2 gravity = physics_->world().GetGravity();
  sensors.linear_velocity = to_vector3(velocity);
  sensors.linear_acceleration = to_vector3(acceleration);
  sensors.gravity = to_vector3(gravity);
  sensors.angular_velocity = {0, -double{hull.GetAngularVelocity()}, 0};

  for (std::size_t i = 0; i < lidar_.size(); ++i) {
    constexpr double kNothing = std::numeric_limits<double>::infinity();
    const double range = double{lidar_[i].fraction} * world_.lidar_range;
    sensors.ranges[i] = lidar_[i].hit ? range : kNothing;
  }
  sensors.maximum_range = world_.lidar_range;
  for (std::size_t leg = 0; leg < 2; ++leg) {
    sensors.contacts[leg] = physics_->leg_touches(leg) ? 1 : 0;
  }
}

void BipedalWalker::scene(Scene& scene) const { describe_scene(ground_, clouds_, scene); }

/// Ground and clouds are not written; `load` draws them again from the generator's state.
void BipedalWalker::save(StateWriter& writer) const {
  writer.number(std::uint8_t{physics_.has_value()});
  if (!physics_) return;
  writer.numbers(ground_origin_.data(), ground_origin_.size());
  writer.number(std::uint8_t{shaping_.has_value()});
  writer.number(shaping_.value_or(0));
  writer.number(velocity_before_step_);
  for (const RayHit& ray : lidar_) {
    writer.number(ray.fraction);
    writer.number(std::uint8_t{ray.hit});
  }
  physics_->save(writer);
}

std::function<void()> BipedalWalker::load(StateReader& reader, const WorldValues& values,
                                          bool is_alive) {
  const WorldSettings world = settings_of(values);
  if (!reader.flag()) {  // the next reset makes a world
    if (is_alive) refuse_state("it has no world");
    return [this, world] {
      physics_.reset();
      next_world_ = world;
    };
  }
  GeneratorState ground_origin{};
  reader.numbers(ground_origin.data(), ground_origin.size());
  const bool has_shaping = reader.flag();
  std::optional<double> shaping =
      reader.finite_number<double>("the shaping", 10 * double{kMaxSaved});
  if (!has_shaping) shaping.reset();
  b2Vec2 velocity_before_step;
  for (float* const component : {&velocity_before_step.x, &velocity_before_step.y}) {
    *component = reader.finite_number("the velocity before the step", kMaxSaved);
  }
  LidarScan lidar;
  for (RayHit& ray : lidar) {
    ray.fraction = reader.finite_number("the fraction of a ray", 1.0F);
    ray.hit = reader.flag();
  }
  const bool is_same_world = physics_ && ground_origin == ground_origin_ && world == world_;
  Ground ground;
  Clouds clouds{};
  if (!is_same_world) {
    Generator generator(ground_origin);
    ground = draw_ground(generator, is_hardcore_, world.level);
    clouds = generate_clouds(generator);
  }
  auto restore = Physics::read_state(reader, is_same_world ? ground_ : ground);
  return [this, world, is_same_world, ground_origin, clouds, shaping, velocity_before_step, lidar,
          ground = std::move(ground), restore = std::move(restore)] {
    if (!is_same_world) {
      ground_origin_ = ground_origin;
      ground_ = ground;
      clouds_ = clouds;
      world_ = world;
      build_world(0, false);
    }
    next_world_ = world;
    restore(*physics_);
    shaping_ = shaping;
    velocity_before_step_ = velocity_before_step;
    lidar_ = lidar;
  };
}

}  // namespace walker::bipedal_walker
