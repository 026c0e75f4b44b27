#include "walker_sim/registry.h"

#include <limits>

#include "base/parameter_text.h"
#include "robots/bipedal_walker/registration.h"
#include "robots/hopper/registration.h"
#include "robots/walker2d/registration.h"

namespace walker {

const std::vector<Registration>& registrations() {
  static const std::vector<Registration> kAll = [] {
    std::vector<Registration> all;
    for (const auto& of_robot :
         {bipedal_walker::registrations(), walker2d::registrations(), hopper::registrations()}) {
      all.insert(all.end(), of_robot.begin(), of_robot.end());
    }
    return all;
  }();
  return kAll;
}

const Registration& find_registration(const std::string& id) {
  for (const Registration& registration : registrations()) {
    if (registration.id == id) return registration;
  }
  std::vector<std::string> ids;
  for (const Registration& known : registrations()) ids.push_back(known.id);
  refuse_unknown("environment " + id, id, ids);
}

std::vector<ParameterDescription> parameter_descriptions(const std::string& id) {
  const Registration& registration = find_registration(id);
  std::vector<ParameterDescription> descriptions = registration.parameters;
  descriptions.push_back({"max_episode_steps", std::int64_t{registration.max_episode_steps},
                          "steps", "Step on which the time limit truncates an episode; 0: never.",
                          0, std::numeric_limits<std::uint32_t>::max()});
  return descriptions;
}

std::unique_ptr<ObservationBuilder> make_observation_builder(const std::string& id,
                                                             const Parameters& given) {
  const Parameters complete = complete_parameters(parameter_descriptions(id), given);
  return find_registration(id).create_observation_builder(id, complete);
}

std::vector<ParameterDescription> camera_parameter_descriptions(const std::string& id) {
  return find_registration(id).camera_parameters;
}

std::unique_ptr<Renderer> make_renderer(const std::string& id, const Parameters& given,
                                        const Parameters& camera) {
  const Parameters complete = complete_parameters(parameter_descriptions(id), given);
  const Registration& registration = find_registration(id);
  return registration.create_renderer(id, complete,
                                      complete_parameters(registration.camera_parameters, camera));
}

const char* version() { return WALKER_SIM_VERSION; }

}  // namespace walker
