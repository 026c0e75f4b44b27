#include "robots/bipedal_walker/registration.h"

#include "base/limits.h"
#include "robots/bipedal_walker/bipedal_walker.h"
#include "robots/bipedal_walker/constants.h"
#include "robots/bipedal_walker/heuristic.h"
#include "robots/bipedal_walker/observation.h"
#include "robots/bipedal_walker/renderer.h"
#include "robots/bipedal_walker/world_settings.h"

namespace walker::bipedal_walker {
namespace {

Registration registration(const std::string& id, bool hardcore, std::uint32_t max_episode_steps) {
  Registration made;
  made.id = id;
  made.parameters = {
      {"hardcore", hardcore, "", "Terrain with stumps, stairs and pits.", 0, 0},
      {"reuse_world", false, "",
       "Keep the Box2D world between resets, as Gymnasium does; then later episodes depend on "
       "earlier ones.",
       0, 0}};
  made.world_parameters = world_parameters(hardcore);
  made.check_world = [hardcore](const World& world) { check_world(world, hardcore); };
  made.push_impulse = kPushImpulse;
  made.max_episode_steps = max_episode_steps;
  made.reward_threshold = kRewardThreshold;
  made.failure_reward = kFallReward;
  made.create = [](const std::string& name, const Parameters& given) {
    return std::make_unique<BipedalWalker>(name, given);
  };
  made.create_observation_builder = make_observation_builder;
  made.create_gait = [](const Specification& /*specification*/) {
    return std::make_unique<Heuristic>();
  };
  made.camera_parameters = {
      {"width", std::int64_t{600}, "pixels", "Width of the picture.", 1, kMaxPixels},
      {"height", std::int64_t{400}, "pixels", "Height of the picture.", 1, kMaxPixels}};
  made.create_renderer = [](const std::string& /*name*/, const Parameters& /*given*/,
                            const Parameters& camera) { return make_renderer(camera); };
  made.render_modes = {"human", "rgb_array"};
  return made;
}

}  // namespace

std::vector<Registration> registrations() {
  return {registration("BipedalWalker-v3", false, 1600),
          registration("BipedalWalkerHardcore-v3", true, 2000)};
}

}  // namespace walker::bipedal_walker
