// Registry of the environments by id.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "walker_sim/agent.h"
#include "walker_sim/environment.h"
#include "walker_sim/observation_builder.h"
#include "walker_sim/renderer.h"
#include "walker_sim/world.h"

namespace walker {

class Robot;

/// Registry entry of an environment, defined in its robot's folder.
struct Registration {
  std::string id;
  std::vector<ParameterDescription> parameters;  ///< without `max_episode_steps`
  std::vector<WorldParameter> world_parameters;  ///< of level and physics; others are common
  /// Refuses worlds whose values contradict each other; empty: none does.
  /// @throws std::invalid_argument
  std::function<void(const World&)> check_world;
  double push_impulse = 0;              ///< default of the world's parameter [N s]
  std::uint32_t max_episode_steps = 0;  ///< default limit; 0: none
  /// Gymnasium's `reward_threshold`; NaN: none.
  double reward_threshold = std::numeric_limits<double>::quiet_NaN();
  /// Reward of a terminating step if the robot fell; any other reward means that it arrived.
  /// std::nullopt: terminations are not distinguished.
  std::optional<double> failure_reward;
  /// Creates a robot (src/robots/robot.h) from a complete set of parameters.
  std::function<std::unique_ptr<Robot>(const std::string& id, const Parameters&)> create;
  std::function<std::unique_ptr<ObservationBuilder>(const std::string& id, const Parameters&)>
      create_observation_builder;
  /// Creates the agent "heuristic", the environment's gait; empty: it has none.
  /// @throws std::invalid_argument if the gait does not fit the environment's parameters
  std::function<std::unique_ptr<Agent>(const Specification&)> create_gait;
  std::vector<ParameterDescription> camera_parameters;
  /// Creates the environment's renderer from complete sets of parameters.
  std::function<std::unique_ptr<Renderer>(const std::string& id, const Parameters&,
                                          const Parameters& camera)>
      create_renderer;
  std::vector<std::string> render_modes;     ///< of Gymnasium's environment of this id
  bool takes_default_camera_config = false;  ///< whether Gymnasium's has this keyword
};

/// Returns all registrations, in the order of registry.cpp.
WALKER_SIM_EXPORT const std::vector<Registration>& registrations();

/// @throws std::invalid_argument naming the id and the known ones
WALKER_SIM_EXPORT const Registration& find_registration(const std::string& id);

/// Returns the parameters that `make` accepts for this id, including `max_episode_steps`.
WALKER_SIM_EXPORT std::vector<ParameterDescription> parameter_descriptions(const std::string& id);

/// @throws std::invalid_argument if the id or a parameter is unknown or a value is out of range
WALKER_SIM_EXPORT std::unique_ptr<Environment> make(const std::string& id,
                                                    const Parameters& given = {});

/// @throws std::invalid_argument as `make`
WALKER_SIM_EXPORT std::unique_ptr<ObservationBuilder> make_observation_builder(
    const std::string& id, const Parameters& given = {});

WALKER_SIM_EXPORT std::vector<ParameterDescription> camera_parameter_descriptions(
    const std::string& id);

/// @throws std::invalid_argument as `make`
WALKER_SIM_EXPORT std::unique_ptr<Renderer> make_renderer(const std::string& id,
                                                          const Parameters& given = {},
                                                          const Parameters& camera = {});

/// This package's version, e.g. "1.0.0".
WALKER_SIM_EXPORT const char* version();

}  // namespace walker
