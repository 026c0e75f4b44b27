#include "episode/episode.h"
#include "walker_sim/registry.h"

namespace walker {

std::unique_ptr<Episode> make_episode(const std::string& id, const Parameters& given) {
  const Parameters complete = complete_parameters(parameter_descriptions(id), given);
  return std::make_unique<Episode>(find_registration(id).create(id, complete));
}

std::unique_ptr<Environment> make(const std::string& id, const Parameters& given) {
  return make_episode(id, given);
}

}  // namespace walker
