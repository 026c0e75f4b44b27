#include "episode/disturbances.h"

#include <algorithm>
#include <cmath>

#include "base/link_parameters.h"
#include "episode/checked_world.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

/// Names of the parameters that `Disturbances` reads.
constexpr std::array<const char*, 12> kNames{
    "push_interval",          "push_impulse",          "action_delay",
    "action_noise",           "observation_delay",     "dropout",
    "joint_position_noise",   "joint_velocity_noise",  "orientation_noise",
    "angular_velocity_noise", "linear_velocity_noise", "range_noise"};

void write(const std::deque<std::vector<double>>& rows, StateWriter& writer) {
  writer.number(static_cast<std::uint32_t>(rows.size()));
  for (const std::vector<double>& row : rows) writer.numbers(row.data(), row.size());
}

void read(StateReader& reader, std::size_t row_size, std::deque<std::vector<double>>& rows) {
  rows.resize(reader.count(row_size * sizeof(double)));
  for (std::vector<double>& row : rows) {
    row.resize(row_size);
    reader.finite_numbers(row.data(), row_size, "delayed actions and observations");
  }
}

}  // namespace

Disturbances::Disturbances(const WorldValues& values, const Specification& specification,
                           const GeneratorState& episode)
    : dt_(specification.dt),
      action_delay_(to_steps(value_or(values, "action_delay", 0), specification.dt)),
      observation_delay_(to_steps(value_or(values, "observation_delay", 0), specification.dt)),
      ranges_are_optional_(specification.range_finder.is_optional),
      action_noise_(value_or(values, "action_noise", 0)),
      dropout_(value_or(values, "dropout", 0)),
      joint_position_noise_(value_or(values, "joint_position_noise", 0)),
      joint_velocity_noise_(value_or(values, "joint_velocity_noise", 0)),
      orientation_noise_(value_or(values, "orientation_noise", 0)),
      angular_velocity_noise_(value_or(values, "angular_velocity_noise", 0)),
      linear_velocity_noise_(value_or(values, "linear_velocity_noise", 0)),
      range_noise_(value_or(values, "range_noise", 0)),
      push_generator_(derive(episode, "push")),
      action_generator_(derive(episode, "action")),
      sensing_generator_(derive(episode, "sensing")),
      action_(specification.action_size()),
      actions_(action_delay_, std::vector<double>(specification.action_size())),
      observed_(specification.observation_size()) {
  const auto interval = values.find("push_interval");
  if (interval != values.end()) {
    push_period_ = std::max(1U, to_steps(interval->second, specification.dt));
    const auto impulse = values.find("push_impulse");
    push_impulse_ = impulse != values.end() ? impulse->second
                                            : find_registration(specification.id).push_impulse;
  }
  has_noise_ = joint_position_noise_ > 0 || joint_velocity_noise_ > 0 || orientation_noise_ > 0 ||
               angular_velocity_noise_ > 0 || linear_velocity_noise_ > 0 || range_noise_ > 0;
  noise_.joint_position.resize(specification.joints.size());
  noise_.joint_velocity.resize(specification.joints.size());
  noise_.ranges.resize(specification.range_finder.num_rays);
  for (const Link& link : specification.links) link_names_.push_back(link.name);
  set_forces(values);
}

bool Disturbances::has_any(const WorldValues& values) {
  return std::any_of(values.begin(), values.end(), [](const auto& name_value) {
    const std::string& name = name_value.first;
    return is_force_name(name) || std::find(kNames.begin(), kNames.end(), name) != kNames.end();
  });
}

void Disturbances::set_forces(const WorldValues& values) {
  forces_.clear();
  for (std::uint32_t link = 0; link < link_names_.size(); ++link) {
    const double x = value_or(values, force_name(link_names_[link], 'x'), 0);
    const double z = value_or(values, force_name(link_names_[link], 'z'), 0);
    if (link == 0) {
      constant_push_ = {x * dt_, z * dt_};
    } else if (x != 0 || z != 0) {
      forces_.push_back({link, x, z, 0});
    }
  }
}

void Disturbances::begin_step(const double* action, std::uint32_t step, RobotStep& robot_step) {
  const std::size_t size = action_.size();
  actions_.emplace_back(action, action + size);
  action_.swap(actions_.front());
  actions_.pop_front();
  if (action_noise_ > 0) {
    normals_.resize(size);
    action_generator_.normals(normals_.data(), size);
    for (std::size_t i = 0; i < size; ++i) action_[i] += action_noise_ * normals_[i];
  }
  robot_step.action = action_.data();
  robot_step.push = constant_push_;
  robot_step.forces = forces_.empty() ? nullptr : &forces_;
  if (push_period_ == 0 || step % push_period_ != 0) return;
  const double direction = push_generator_.uniform(0, 2 * M_PI);
  robot_step.push[0] += push_impulse_ * std::cos(direction);
  robot_step.push[1] += push_impulse_ * std::sin(direction);
}

void Disturbances::observe(Robot& robot, std::uint32_t step, double* observation) {
  step_ = step;
  if (has_noise_) {
    draw_noise();
    robot.observe(noise_, observation);
  } else {
    robot.observe(observation);
  }
  if (!is_delayed()) {
    observed_step_ = step;
    return;
  }
  if (!measured_.empty()) remember_sensors(robot);
  const bool is_first = observations_.empty();
  observations_.emplace_back(observation, observation + observed_.size());
  if (observations_.size() > observation_delay_ + 1U) observations_.pop_front();
  const bool is_dropped = !is_first && dropout_ > 0 && sensing_generator_.random() < dropout_;
  if (!is_dropped) {
    observed_ = observations_.front();
    observed_step_ = step + 1 - static_cast<std::uint32_t>(observations_.size());
    while (measured_.size() > 1 && measured_[1].step <= observed_step_) measured_.pop_front();
  }
  std::copy(observed_.begin(), observed_.end(), observation);
}

/// Draws as many numbers whichever deviations are 0, so that each error depends on its own only.
/// Optional ranges have a generator for each step, derived from that of the other errors: these are
/// the same with and without the ranges.
void Disturbances::draw_noise() {
  const std::size_t joints = noise_.joint_position.size();
  const std::size_t rays = noise_.ranges.size();
  normals_.resize(2 * joints + 4 + (ranges_are_optional_ ? 0 : rays));
  sensing_generator_.normals(normals_.data(), normals_.size());
  const double* next = normals_.data();
  const auto take = [&next](std::vector<double>& errors, double deviation) {
    for (double& error : errors) error = deviation * *next++;
  };
  take(noise_.joint_position, joint_position_noise_);
  take(noise_.joint_velocity, joint_velocity_noise_);
  noise_.pitch = orientation_noise_ * *next++;
  noise_.angular_velocity = angular_velocity_noise_ * *next++;
  for (double& error : noise_.linear_velocity) error = linear_velocity_noise_ * *next++;
  if (ranges_are_optional_) {
    if (range_noise_ == 0) return;
    normals_.resize(rays);
    derive(sensing_generator_.state(), "ranges").normals(normals_.data(), rays);
    next = normals_.data();
  }
  take(noise_.ranges, range_noise_);
}

/// Keeps what is observed now, and all that a later step may observe.
void Disturbances::remember_sensors(Robot& robot) {
  measured_.push_back({step_, {}});
  sense(robot, measured_.back().sensors);
  const std::uint32_t oldest = step_ > observation_delay_ ? step_ - observation_delay_ : 0;
  while (measured_.size() > 2 && measured_[2].step <= oldest) {
    measured_.erase(measured_.begin() + 1);
  }
}

void Disturbances::sense(Robot& robot, Sensors& sensors) const {
  robot.sense(sensors);
  if (has_noise_) add(noise_, sensors);
}

std::uint32_t Disturbances::measure(Robot& robot, Sensors& sensors) {
  if (!is_delayed()) {
    sense(robot, sensors);
    return step_;
  }
  if (measured_.empty()) remember_sensors(robot);
  sensors = measured_.front().sensors;
  return measured_.front().step;
}

void Disturbances::forget_past() {
  observations_.clear();
  measured_.clear();
}

void Disturbances::save(StateWriter& writer) const {
  for (const Generator* generator : {&push_generator_, &action_generator_, &sensing_generator_}) {
    write_generator(*generator, writer);
  }
  writer.number(step_);
  writer.number(observed_step_);
  writer.numbers(observed_.data(), observed_.size());
  write(actions_, writer);
  write(observations_, writer);
}

void Disturbances::load(StateReader& reader) {
  for (Generator* generator : {&push_generator_, &action_generator_, &sensing_generator_}) {
    *generator = read_generator(reader);
  }
  step_ = reader.number<std::uint32_t>();
  observed_step_ = reader.number<std::uint32_t>();
  reader.finite_numbers(observed_.data(), observed_.size(), "the delivered observation");
  read(reader, action_.size(), actions_);
  read(reader, observed_.size(), observations_);
  if (actions_.size() != action_delay_ || observations_.size() > observation_delay_ + 1U) {
    refuse_state("the number of its delayed actions or observations contradicts its delays");
  }
}

}  // namespace walker
