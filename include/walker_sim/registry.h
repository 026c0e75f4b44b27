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

/// How an environment type enters the registry: its folder fills this, registry.cpp lists it.
struct Registration {
  std::string id;
  std::vector<ParameterDescription> parameters;  ///< its own; `max_episode_steps` is added
  std::uint32_t max_episode_steps = 0;           ///< default limit; 0: none
  /// What Gymnasium calls solved; NaN: it does not say.
  double reward_threshold = std::numeric_limits<double>::quiet_NaN();
  /// Reward of a step that ends an episode in a failure; one that ends with another has arrived.
  /// None: every end but the time limit's is of one kind.
  std::optional<double> failure_reward;
  /// Builds a robot from its complete parameters (src/robots/robot.h).
  std::function<std::unique_ptr<Robot>(const std::string& id, const Parameters&)> create;
  /// Builds what makes that environment's observation out of sensors' measurements.
  std::function<std::unique_ptr<ObservationBuilder>(const std::string& id, const Parameters&)>
      create_observation_builder;
  /// Builds the agent "heuristic", a gait for that environment; empty: there is none.
  /// @throws std::invalid_argument for an environment with parameters that it does not fit
  std::function<std::unique_ptr<Agent>(const Specification&)> create_gait;
  std::vector<ParameterDescription> camera_parameters;
  /// Builds what draws that environment, with a complete set of camera parameters.
  std::function<std::unique_ptr<Renderer>(const std::string& id, const Parameters&,
                                          const Parameters& camera)>
      create_renderer;
  // What Gymnasium's own environment of this id offers of pictures.
  std::vector<std::string> render_modes;
  bool takes_default_camera_config = false;  ///< as a keyword
};

/// All registrations, in the order of registry.cpp.
WALKER_SIM_EXPORT const std::vector<Registration>& registrations();

/// @throws std::invalid_argument naming the id and the known ones
WALKER_SIM_EXPORT const Registration& find_registration(const std::string& id);

/// Parameters that `make` takes for this id, `max_episode_steps` included.
WALKER_SIM_EXPORT std::vector<ParameterDescription> parameter_descriptions(const std::string& id);

/// Creates an environment. It keeps the time limit, and refuses steps outside an episode and
/// malformed actions.
/// @throws std::invalid_argument for an unknown id or parameter or a value out of range
WALKER_SIM_EXPORT std::unique_ptr<Environment> make(const std::string& id,
                                                    const Parameters& given = {});

/// Creates what makes the observations of the environment that `make` would make, on a robot.
/// @throws std::invalid_argument as `make`
WALKER_SIM_EXPORT std::unique_ptr<ObservationBuilder> make_observation_builder(
    const std::string& id, const Parameters& given = {});

/// Parameters of the camera that `make_renderer` takes for this id.
WALKER_SIM_EXPORT std::vector<ParameterDescription> camera_parameter_descriptions(
    const std::string& id);

/// Creates what draws the environments that `make` makes with these parameters.
/// @param camera parameters of the camera
/// @throws std::invalid_argument as `make`
WALKER_SIM_EXPORT std::unique_ptr<Renderer> make_renderer(const std::string& id,
                                                          const Parameters& given = {},
                                                          const Parameters& camera = {});

/// This package's version, e.g. "0.1.0".
WALKER_SIM_EXPORT const char* version();

}  // namespace walker
