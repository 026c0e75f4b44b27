// Environments by id.
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

namespace walker {

class Robot;

/// An environment type's entry in the registry, filled in by the robot's folder.
struct Registration {
  std::string id;
  std::vector<ParameterDescription> parameters;  ///< its own; `max_episode_steps` is added
  std::uint32_t max_episode_steps = 0;           ///< default limit; 0: none
  /// Gymnasium's `reward_threshold`; NaN: none.
  double reward_threshold = std::numeric_limits<double>::quiet_NaN();
  /// Reward of a step that terminates an episode by a fall; with any other the robot has arrived.
  /// None: all terminations are of one kind.
  std::optional<double> failure_reward;
  /// Builds a robot from its complete parameters (src/robots/robot.h).
  std::function<std::unique_ptr<Robot>(const std::string& id, const Parameters&)> create;
  /// Builds the object that computes the environment's observation from sensors' measurements.
  std::function<std::unique_ptr<ObservationBuilder>(const std::string& id, const Parameters&)>
      create_observation_builder;
  /// Builds the agent "heuristic", a gait for the environment; empty: there is none.
  /// @throws std::invalid_argument if it does not fit the environment's parameters
  std::function<std::unique_ptr<Agent>(const Specification&)> create_gait;
  std::vector<ParameterDescription> camera_parameters;
  /// Builds the environment's renderer from a complete set of camera parameters.
  std::function<std::unique_ptr<Renderer>(const std::string& id, const Parameters&,
                                          const Parameters& camera)>
      create_renderer;
  std::vector<std::string> render_modes;     ///< of Gymnasium's environment of this id
  bool takes_default_camera_config = false;  ///< whether that one has this keyword
};

/// All registrations, in the order of registry.cpp.
WALKER_SIM_EXPORT const std::vector<Registration>& registrations();

/// @throws std::invalid_argument naming the id and the known ones
WALKER_SIM_EXPORT const Registration& find_registration(const std::string& id);

/// Parameters that `make` takes for this id, `max_episode_steps` included.
WALKER_SIM_EXPORT std::vector<ParameterDescription> parameter_descriptions(const std::string& id);

/// Creates an environment: the registered robot and its episode.
/// @throws std::invalid_argument if the id or a parameter is unknown or a value is out of range
WALKER_SIM_EXPORT std::unique_ptr<Environment> make(const std::string& id,
                                                    const Parameters& given = {});

/// Creates the observation builder of the environment that `make` would make.
/// @throws std::invalid_argument as `make`
WALKER_SIM_EXPORT std::unique_ptr<ObservationBuilder> make_observation_builder(
    const std::string& id, const Parameters& given = {});

/// Parameters of the camera that `make_renderer` takes for this id.
WALKER_SIM_EXPORT std::vector<ParameterDescription> camera_parameter_descriptions(
    const std::string& id);

/// Creates the renderer of the environments that `make` makes with these parameters.
/// @param camera parameters of the camera
/// @throws std::invalid_argument as `make`
WALKER_SIM_EXPORT std::unique_ptr<Renderer> make_renderer(const std::string& id,
                                                          const Parameters& given = {},
                                                          const Parameters& camera = {});

/// This package's version, e.g. "0.1.0".
WALKER_SIM_EXPORT const char* version();

}  // namespace walker
