#include "robots/mujoco/locomotion_robot.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "base/range_finder.h"
#include "robots/mujoco/renderer.h"

namespace walker::mujoco {
namespace {

// Constants that Hopper and Walker2d share (gymnasium/envs/mujoco/hopper_v4.py, hopper_v5.py,
// walker2d_v4.py, walker2d_v5.py, 1.4.0).
constexpr std::uint32_t kMaxEpisodeSteps = 1000;
constexpr int kFrameSkip = 4;
constexpr double kVelocityLimit = 10;  // bound of observed velocities [m/s, rad/s]

/// Indices into v5's info. v4's has the position and the velocity only.
enum InfoIndex : std::size_t {
  kPositionX,
  kDistanceZ,
  kVelocityX,
  kRewardForward,
  kRewardControl,
  kRewardSurvive
};

/// Converts to single precision, clamped to its finite range.
float saturated(double value) {
  constexpr double kMax = std::numeric_limits<float>::max();
  return static_cast<float>(std::clamp(value, -kMax, kMax));
}

/// Adds reward (`reward_of_step`), health (`HealthyRange`) and info. A step terminates the episode
/// if the robot is unhealthy after it and terminate_when_unhealthy is set.
class LocomotionRobot : public PlanarRobot {
 public:
  LocomotionRobot(const PlanarOptions& options, const RewardOptions& reward,
                  std::vector<HealthyRange> healthy_ranges)
      : PlanarRobot(options), reward_(reward), healthy_ranges_(std::move(healthy_ranges)) {}

  std::optional<bool> is_healthy() const override { return unhealthy_reason()[0] == '\0'; }

 private:
  /// v4's info is empty after a reset.
  void write_reset_info(double* info) const override {
    if (!reward_.is_v5) return;
    info[kPositionX] = position()[kBaseX];
    info[kDistanceZ] = position()[kBaseZ] - model().qpos0[kBaseZ];
  }

  void conclude_step(double x_velocity, RobotStep& step) const override {
    const char* const illness = unhealthy_reason();
    const bool is_healthy = illness[0] == '\0';
    const RewardTerms terms =
        reward_of_step(reward_, x_velocity, is_healthy, step.action, model().nu);
    step.reward = terms.total();
    step.terminated = !is_healthy && reward_.terminate_when_unhealthy;
    step.end_reason = step.terminated ? illness : "";
    if (reward_.is_v5) {
      write_reset_info(step.info);
      step.info[kVelocityX] = x_velocity;
      step.info[kRewardForward] = terms.forward;
      step.info[kRewardControl] = terms.control;
      step.info[kRewardSurvive] = terms.survive;
    } else {
      step.info[0] = position()[kBaseX];
      step.info[1] = x_velocity;
    }
  }

  /// Returns a static text; empty if the robot is healthy.
  const char* unhealthy_reason() const {
    const int nq = model().nq;
    const int state_size = nq + model().nv;
    for (const HealthyRange& range : healthy_ranges_) {
      const int end = std::min(range.end, state_size);
      for (int i = range.begin; i < end; ++i) {
        const double value = i < nq ? position()[i] : velocity()[i - nq];
        const GroundBelow below = i == kBaseZ ? ground_below() : GroundBelow{};
        const bool is_within =
            range.interval[0] < value - below.ground && value - below.top < range.interval[1];
        if (!is_within) return range.end_reason;
      }
    }
    return "";
  }

  RewardOptions reward_;
  std::vector<HealthyRange> healthy_ranges_;
};

struct Version {
  std::shared_ptr<const LocomotionRobotKind> kind;
  bool is_v5;

  std::string id() const { return kind->name + (is_v5 ? "-v5" : "-v4"); }
  std::string v4_model() const { return kind->model + "_v4.xml"; }
  std::string v5_model() const { return kind->model + "_v5.xml"; }
  std::string model() const { return is_v5 ? v5_model() : v4_model(); }
};

/// Returns Gymnasium's constructor parameters, in its order.
std::vector<ParameterDescription> parameters(const Version& version) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr double kMaxWeight = 1e9;
  constexpr double kMaxNoise = 1e6;
  constexpr double kMaxFrames = 1000;
  std::vector<ParameterDescription> all{
      {"xml_file", version.model(), "",
       "MJCF file of the model; " + version.v4_model() + " and " + version.v5_model() +
           " are built in.",
       0, 0},
      {"frame_skip", std::int64_t{kFrameSkip}, "", "Engine steps of one environment step.", 1,
       kMaxFrames},
      {"forward_reward_weight", 1.0, "s/m", "Reward for the velocity along x.", -kMaxWeight,
       kMaxWeight},
      {"ctrl_cost_weight", 1e-3, "", "Cost of the sum of the squared actions.", -kMaxWeight,
       kMaxWeight},
      {"healthy_reward", 1.0, "", "Reward of a step that ends healthy.", -kMaxWeight, kMaxWeight},
      {"terminate_when_unhealthy", true, "", "End the episode when unhealthy.", 0, 0}};
  if (!version.is_v5) all.erase(all.begin(), all.begin() + 2);  // v4 has a fixed model and skip
  for (const HealthyRange& range : version.kind->healthy_ranges) {
    all.push_back({range.name, std::vector<double>(range.interval.begin(), range.interval.end()),
                   range.unit, range.description, -kInfinity, kInfinity});
  }
  all.push_back({"reset_noise_scale", 5e-3, "m, rad, m/s, rad/s",
                 "Largest deviation of each position and velocity at a reset.", 0, kMaxNoise});
  all.push_back({"exclude_current_positions_from_observation", true, "",
                 "Leave the torso's x out of the observation.", 0, 0});
  all.push_back({"include_lidar_in_observation", false, "",
                 "Append the lidar's ten distances, as fractions of its range, to the observation.",
                 0, 0});
  return all;
}

double lidar_range(const LocomotionRobotKind& kind) { return kLidarRangePerLeg * kind.leg_length; }

template <typename Value>
Value value_of(const Parameters& parameters, const std::string& name) {
  return std::get<Value>(parameters.at(name));
}

PlanarOptions to_options(const Version& version, const Parameters& given) {
  PlanarOptions options;
  Specification& specification = options.specification;
  specification.id = version.id();
  for (const ParameterDescription& description : parameters(version)) {
    specification.parameters.emplace_back(description.name, given.at(description.name));
  }
  specification.parameters.emplace_back("max_episode_steps", given.at("max_episode_steps"));
  specification.max_episode_steps =
      static_cast<std::uint32_t>(value_of<std::int64_t>(given, "max_episode_steps"));
  specification.reward_threshold = version.kind->reward_threshold;
  specification.info_names = {"x_position", "x_velocity"};
  options.model = {version.model(), version.kind->num_hinges, version.v5_model()};
  options.bodies = version.kind->bodies;
  options.frame_skip = kFrameSkip;
  if (version.is_v5) {
    specification.info_names = {"x_position",  "z_distance_from_origin",
                                "x_velocity",  "reward_forward",
                                "reward_ctrl", "reward_survive"};
    options.model.xml_file = value_of<std::string>(given, "xml_file");
    options.frame_skip = static_cast<int>(value_of<std::int64_t>(given, "frame_skip"));
  }
  options.make_physics = version.kind->make_physics;
  options.reset_noise_scale = value_of<double>(given, "reset_noise_scale");
  options.exclude_current_positions_from_observation =
      value_of<bool>(given, "exclude_current_positions_from_observation");
  options.include_lidar_in_observation = value_of<bool>(given, "include_lidar_in_observation");
  options.lidar_range = lidar_range(*version.kind);
  options.velocity_limit = kVelocityLimit;
  return options;
}

std::unique_ptr<Robot> create(const Version& version, const Parameters& given) {
  const RewardOptions reward{value_of<double>(given, "forward_reward_weight"),
                             value_of<double>(given, "ctrl_cost_weight"),
                             value_of<double>(given, "healthy_reward"),
                             value_of<bool>(given, "terminate_when_unhealthy"), version.is_v5};
  std::vector<HealthyRange> ranges = version.kind->healthy_ranges;
  for (HealthyRange& range : ranges) {
    const auto limits = value_of<std::vector<double>>(given, range.name);
    if (!(limits[0] < limits[1])) {
      throw std::invalid_argument("parameter " + range.name + " = " +
                                  to_string(given.at(range.name)) +
                                  ": must be a lower number, then a higher one");
    }
    range.interval = {limits[0], limits[1]};
  }
  return std::make_unique<LocomotionRobot>(to_options(version, given), reward, std::move(ranges));
}

/// A linear function of the observed positions and velocities, without state:
///
///   action_m = clamp(constant_m + sum_i weight_mi observation_i, -1, 1), rounded to float32
class LinearGait : public Agent {
 public:
  LinearGait(std::vector<MotorWeights> motors, const Specification& specification)
      : motors_(std::move(motors)), action_(motors_.size()) {
    const RangeFinder& finder = specification.range_finder;
    const std::size_t state_size =
        specification.observation_size() - (finder.is_observed ? finder.num_rays : 0);
    if (state_size != motors_.front().of_observation.size()) {
      throw std::invalid_argument("agent = heuristic: needs " + specification.id +
                                  " with exclude_current_positions_from_observation = true");
    }
  }

  void reset() override {}

  const std::vector<double>& act(const std::vector<double>& observation) override {
    for (std::size_t motor = 0; motor < motors_.size(); ++motor) {
      double control = motors_[motor].constant;
      const std::vector<double>& weights = motors_[motor].of_observation;
      for (std::size_t i = 0; i < weights.size(); ++i) control += weights[i] * observation[i];
      action_[motor] = double{static_cast<float>(std::clamp(control, -1.0, 1.0))};
    }
    return action_;
  }

 private:
  std::vector<MotorWeights> motors_;
  std::vector<double> action_;
};

Registration registration(const Version& version) {
  Registration made;
  made.id = version.id();
  made.parameters = parameters(version);
  made.world_parameters = level_parameters();
  const std::vector<WorldParameter> physics = physics_parameters(
      version.kind->joint_damping, version.kind->bodies, version.kind->push_impulse);
  made.world_parameters.insert(made.world_parameters.end(), physics.begin(), physics.end());
  made.world_parameters.push_back(lidar_range_parameter(lidar_range(*version.kind)));
  made.world_parameters.push_back(range_noise_parameter());
  made.check_world = [](const World& world) { check_level(world, kGroundSize, false, ""); };
  made.push_impulse = version.kind->push_impulse;
  made.max_episode_steps = kMaxEpisodeSteps;
  made.reward_threshold = version.kind->reward_threshold;
  made.create = [version](const std::string& /*id*/, const Parameters& given) {
    return create(version, given);
  };
  made.create_observation_builder = [version](const std::string& /*id*/, const Parameters& given) {
    return make_observation_builder(to_options(version, given));
  };
  if (!version.kind->gait.empty()) {
    made.create_gait = [version](const Specification& specification) {
      return std::make_unique<LinearGait>(version.kind->gait, specification);
    };
  }
  made.camera_parameters = camera_parameters(version.kind->camera_distance);
  made.create_renderer = [version](const std::string& /*id*/, const Parameters& given,
                                   const Parameters& camera) {
    return make_renderer(to_options(version, given).model, version.kind->name, camera);
  };
  made.render_modes = {"human", "rgb_array", "depth_array", "rgbd_tuple"};
  made.takes_default_camera_config = version.is_v5;
  return made;
}

}  // namespace

RewardTerms reward_of_step(const RewardOptions& options, double x_velocity, bool is_healthy,
                           const double* action, int size) {
  float sum = 0;
  for (int i = 0; i < size; ++i) {
    const float value = saturated(action[i]);
    sum += value * value;
  }
  // An infinite sum would make the cost infinite, or NaN with a weight of 0.
  const float finite_sum = std::min(sum, std::numeric_limits<float>::max());
  const float cost = saturated(double{static_cast<float>(options.ctrl_cost_weight) * finite_sum});
  const bool survives = is_healthy || (!options.is_v5 && options.terminate_when_unhealthy);
  return {options.forward_reward_weight * x_velocity, double{-cost},
          (survives ? 1.0 : 0.0) * options.healthy_reward};
}

std::vector<HealthyRange> torso_ranges(const std::string& robot, std::array<double, 2> heights,
                                       std::array<double, 2> angles) {
  const std::string meaning = " of the torso between which the " + robot + " is healthy.";
  return {{"healthy_z_range", "m", "Heights" + meaning, heights, kBaseZ, kBaseZ + 1,
           "the torso's height left healthy_z_range"},
          {"healthy_angle_range", "rad", "Angles" + meaning, angles, kBasePitch, kBasePitch + 1,
           "the torso's angle left healthy_angle_range"}};
}

std::vector<Registration> registrations(LocomotionRobotKind kind) {
  const auto shared = std::make_shared<const LocomotionRobotKind>(std::move(kind));
  return {registration({shared, false}), registration({shared, true})};
}

}  // namespace walker::mujoco
