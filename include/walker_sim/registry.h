// Environments by id.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "walker_sim/environment.h"
#include "walker_sim/observation_builder.h"
#include "walker_sim/renderer.h"

namespace walker {

/// How an environment type enters the registry: its folder fills this, registry.cpp lists it.
struct Registration {
  std::string id;
  std::vector<ParameterDescription> parameters;  ///< its own; `max_episode_steps` is added
  std::uint32_t max_episode_steps;               ///< default limit; 0: none
  /// Builds an environment from its complete parameters.
  std::function<std::unique_ptr<Environment>(const std::string& id, const Parameters&)> create;
  /// Builds what makes that environment's observation out of sensors' measurements.
  std::function<std::unique_ptr<ObservationBuilder>(const std::string& id, const Parameters&)>
      create_observation_builder;
  std::vector<ParameterDescription> camera_parameters;
  /// Builds what draws that environment, with a complete set of camera parameters.
  std::function<std::unique_ptr<Renderer>(const std::string& id, const Parameters&,
                                          const Parameters& camera)>
      create_renderer;
};

/// All registrations, in the order of registry.cpp.
WALKER_SIM_EXPORT const std::vector<Registration>& registrations();

/// @throws std::invalid_argument naming the id and the known ones
WALKER_SIM_EXPORT const Registration& find_registration(const std::string& id);

/// Parameters that `make` takes for this id, `max_episode_steps` included.
WALKER_SIM_EXPORT std::vector<ParameterDescription> parameter_descriptions(const std::string& id);

/// Creates an environment with the rules of an episode around it: the time limit, refused steps
/// outside an episode, checked actions.
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
