#include "bipedal_walker/registration.h"

#include "bipedal_walker/bipedal_walker.h"

namespace walker::bipedal_walker {
namespace {

std::vector<ParameterDescription> parameters(bool hardcore) {
  return {{"hardcore", hardcore, "", "Terrain with stumps, stairs and pits.", 0, 0},
          {"reuse_world", false, "",
           "Keep the Box2D world between resets, as Gymnasium does; then later episodes depend on "
           "earlier ones.",
           0, 0}};
}

std::unique_ptr<Environment> create(const std::string& id, const Parameters& parameters) {
  Options options;
  options.id = id;
  options.hardcore = std::get<bool>(parameters.at("hardcore"));
  options.reuse_world = std::get<bool>(parameters.at("reuse_world"));
  options.max_episode_steps =
      static_cast<std::uint32_t>(std::get<std::int64_t>(parameters.at("max_episode_steps")));
  return std::make_unique<BipedalWalker>(options);
}

}  // namespace

std::vector<Registration> registrations() {
  return {{"BipedalWalker-v3", parameters(false), 1600, create},
          {"BipedalWalkerHardcore-v3", parameters(true), 2000, create}};
}

}  // namespace walker::bipedal_walker
