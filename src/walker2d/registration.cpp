#include "walker2d/registration.h"

#include <limits>
#include <stdexcept>

#include "walker2d/camera.h"
#include "walker2d/observation_builder.h"
#include "walker2d/renderer.h"
#include "walker2d/walker2d.h"

namespace walker::walker2d {
namespace {

constexpr std::uint32_t kMaxEpisodeSteps = 1000;

/// Gymnasium's constructor parameters, in its order.
std::vector<ParameterDescription> parameters(bool is_v5) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr double kLargestWeight = 1e9;
  constexpr double kLargestNoise = 1e6;
  constexpr double kMostFrames = 1000;
  std::vector<ParameterDescription> all;
  if (is_v5) {
    all.push_back({"xml_file", std::string("walker2d_v5.xml"), "",
                   "MJCF file of the model; walker2d_v4.xml and walker2d_v5.xml are built in.", 0,
                   0});
    all.push_back({"frame_skip", std::int64_t{kFrameSkip}, "",
                   "Engine steps of one environment step.", 1, kMostFrames});
  }
  all.push_back({"forward_reward_weight", 1.0, "s/m", "Reward for the velocity along x.",
                 -kLargestWeight, kLargestWeight});
  all.push_back({"ctrl_cost_weight", 1e-3, "", "Cost of the sum of the squared actions.",
                 -kLargestWeight, kLargestWeight});
  all.push_back({"healthy_reward", 1.0, "", "Reward of a step that ends healthy.", -kLargestWeight,
                 kLargestWeight});
  all.push_back({"terminate_when_unhealthy", true, "", "End the episode when unhealthy.", 0, 0});
  all.push_back({"healthy_z_range", std::vector<double>{0.8, 2.0}, "m",
                 "Heights of the torso between which the walker is healthy.", -kInfinity,
                 kInfinity});
  all.push_back({"healthy_angle_range", std::vector<double>{-1.0, 1.0}, "rad",
                 "Angles of the torso between which the walker is healthy.", -kInfinity,
                 kInfinity});
  all.push_back({"reset_noise_scale", 5e-3, "m, rad, m/s, rad/s",
                 "Largest deviation of each position and velocity at a reset.", 0, kLargestNoise});
  all.push_back({"exclude_current_positions_from_observation", true, "",
                 "Leave the torso's x out of the observation.", 0, 0});
  return all;
}

std::array<double, 2> interval(const Parameters& parameters, const std::string& name) {
  const auto& list = std::get<std::vector<double>>(parameters.at(name));
  if (!(list[0] < list[1])) {
    throw std::invalid_argument("parameter " + name + " = " + to_string(parameters.at(name)) +
                                ": must be a lower number, then a higher one");
  }
  return {list[0], list[1]};
}

Options to_options(bool is_v5, const std::string& id, const Parameters& parameters) {
  const auto number = [&](const char* name) { return std::get<double>(parameters.at(name)); };
  const auto flag = [&](const char* name) { return std::get<bool>(parameters.at(name)); };
  const auto integer = [&](const char* name) {
    return std::get<std::int64_t>(parameters.at(name));
  };
  Options options;
  options.id = id;
  options.is_v5 = is_v5;
  options.xml_file = "walker2d_v4.xml";
  if (is_v5) {
    options.xml_file = std::get<std::string>(parameters.at("xml_file"));
    options.frame_skip = static_cast<int>(integer("frame_skip"));
  }
  options.reward = {number("forward_reward_weight"), number("ctrl_cost_weight"),
                    number("healthy_reward"), flag("terminate_when_unhealthy"), is_v5};
  options.healthy_z_range = interval(parameters, "healthy_z_range");
  options.healthy_angle_range = interval(parameters, "healthy_angle_range");
  options.reset_noise_scale = number("reset_noise_scale");
  options.exclude_current_positions_from_observation =
      flag("exclude_current_positions_from_observation");
  options.max_episode_steps = static_cast<std::uint32_t>(integer("max_episode_steps"));
  return options;
}

Registration registration(const std::string& id, bool is_v5) {
  return {id,
          parameters(is_v5),
          kMaxEpisodeSteps,
          [is_v5](const std::string& name, const Parameters& given) {
            return std::make_unique<Walker2d>(to_options(is_v5, name, given));
          },
          [is_v5](const std::string& name, const Parameters& given) {
            return make_observation_builder(to_options(is_v5, name, given));
          },
          camera_parameters(),
          [is_v5](const std::string& name, const Parameters& given, const Parameters& camera) {
            return make_renderer(to_options(is_v5, name, given).xml_file, camera);
          }};
}

}  // namespace

std::vector<Registration> registrations() {
  return {registration("Walker2d-v4", false), registration("Walker2d-v5", true)};
}

}  // namespace walker::walker2d
