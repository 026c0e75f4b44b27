#include "robots/bipedal_walker/bipedal_walker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <limits>
#include <stdexcept>
#include <string>

#include "robots/bipedal_walker/kernel/trial.h"
#include "robots/bipedal_walker/together.h"

namespace walker::bipedal_walker {
namespace {

std::string stepper_of(const KernelChoice& choice) {
  return choice.kernel != nullptr ? std::string("the library, in groups by the kernel for ") +
                                        choice.kernel->instruction_set
                                  : "the library: " + choice.fallback_reason;
}

/// Computes the arm in the body's frame. Box2D's own function subtracts two world positions, which
/// is inaccurate in single precision far from the origin.
b2Vec2 velocity_of_origin(const b2Body& body) {
  return body.GetLinearVelocity() -
         b2Cross(body.GetAngularVelocity(), body.GetWorldVector(body.GetLocalCenter()));
}

}  // namespace

BipedalWalker::BipedalWalker(const Options& options) : options_(options) {
  const KernelChoice choice = choose_kernel();
  kernel_ = choice.kernel;
  specification_ = make_specification(options, stepper_of(choice));
}

void BipedalWalker::reset(Generator& generator, double* /*info*/) {
  renew_world();
  // Draws in Gymnasium's order: terrain, clouds, push.
  terrain_origin_ = generator.state();
  terrain_ = generate_terrain(generator, options_.hardcore);
  clouds_ = generate_clouds(generator);
  physics_->build(terrain_, generator.uniform(-kInitialPush, kInitialPush));
  reward_.restart();
  // Gymnasium's reset ends with a step without torque and discards its reward and flags.
  const std::array<double, kJointCount> no_torque{};
  advance(no_torque.data());
  reward(no_torque.data());
}

void BipedalWalker::step(RobotStep& step) {
  advance(step.action);
  finish_step(step);
}

void BipedalWalker::step_group(RobotStep* const* steps, std::size_t count) noexcept {
  if (count == 1 || kernel_ == nullptr) return Robot::step_group(steps, count);
  const auto walker_of = [](const RobotStep& step) -> BipedalWalker& {
    return static_cast<BipedalWalker&>(*step.robot);
  };
  std::array<WorldCall, kMaxGroupSize> calls;
  std::array<RobotStep*, kMaxGroupSize> members;
  std::size_t num_calls = 0;
  for (RobotStep* const* step = steps; step != steps + count; ++step) {
    BipedalWalker& walker = walker_of(**step);
    if (walker.kernel_ != kernel_) {
      Robot::step_group(step, 1);
      continue;
    }
    walker.begin_step((*step)->action);
    calls[num_calls].physics = &*walker.physics_;
    members[num_calls++] = *step;
  }
  if (num_calls != 0) step_together(*kernel_, calls.data(), num_calls);
  for (std::size_t i = 0; i < num_calls; ++i) {
    RobotStep& step = *members[i];
    BipedalWalker& walker = walker_of(step);
    try {
      if (calls[i].failure) std::rethrow_exception(calls[i].failure);
      cast_lidar(*walker.physics_, walker.terrain_, walker.lidar_);
      walker.finish_step(step);
    } catch (...) {
      step.failure = walker.break_world();
    }
  }
}

void BipedalWalker::renew_world() {
  if (physics_ && options_.reuse_world && !world_is_broken_) {
    physics_->destroy();
  } else {
    physics_.emplace();
    world_is_broken_ = false;
  }
}

void BipedalWalker::advance(const double* action) {
  begin_step(action);
  try {
    physics_->step();
    cast_lidar(*physics_, terrain_, lidar_);
  } catch (const std::exception&) {
    std::rethrow_exception(break_world());
  }
}

void BipedalWalker::begin_step(const double* action) {
  velocity_before_step_ = velocity_of_origin(physics_->hull());
  physics_->drive(action);
}

/// A failed assertion leaves the world locked permanently.
std::exception_ptr BipedalWalker::break_world() {
  world_is_broken_ = true;
  return std::make_exception_ptr(std::runtime_error("Box2D failed an assertion"));
}

void BipedalWalker::finish_step(RobotStep& step) {
  step.reward = reward(step.action);
  step.end_reason = end_reason();
  step.terminated = step.end_reason[0] != '\0';
}

void BipedalWalker::observe(double* observation) const {
  Observed observed = observed_in(*physics_);
  std::transform(lidar_.begin(), lidar_.end(), observed.ray_fraction.begin(),
                 [](const RayHit& ray) { return double{ray.fraction}; });
  write_observation(observed, observation);
}

double BipedalWalker::reward(const double* action) {
  const b2Body& hull = physics_->hull();
  const bool fell = physics_->hull_has_touched() || hull.GetPosition().x < 0;
  return reward_.of_step(double{hull.GetPosition().x}, double{hull.GetAngle()}, fell, action);
}

const char* BipedalWalker::end_reason() const {
  const auto x = double{physics_->hull().GetPosition().x};
  constexpr double kFarEnd = (kTerrainLength - kTerrainGrass) * kTerrainStep;
  if (physics_->hull_has_touched()) return "hull touched the ground";
  if (x < 0) return "hull left the terrain";
  return x > kFarEnd ? "arrived at the far end" : "";
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
    sensors.ranges[i] = lidar_[i].hit ? double{lidar_[i].fraction} * kLidarRange : kNothing;
  }
  for (std::size_t leg = 0; leg < 2; ++leg) {
    sensors.contacts[leg] = physics_->leg_touches(leg) ? 1 : 0;
  }
}

void BipedalWalker::scene(Scene& scene) const { describe_scene(terrain_, clouds_, scene); }

}  // namespace walker::bipedal_walker
