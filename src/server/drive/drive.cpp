#include "server/drive/drive.h"

#include <stdexcept>

#include <ros/time.h>

#include "episode/failure.h"
#include "server/drive/follow.h"
#include "server/drive/free.h"
#include "server/drive/lockstep.h"

namespace walker {

const EpisodeState& Drive::reset(std::optional<std::uint64_t> seed) {
  begin_episode(seed);
  restart_schedule();
  const EpisodeState& state = simulation_.shown().state();
  if (state.failed_at_reset()) {
    throw std::runtime_error(std::string(kResetFailed) + ": " + state.error);
  }
  return state;
}

std::unique_ptr<Drive> make_drive(const ServerOptions& options, Simulation& simulation) {
  if (options.mode == Mode::lockstep) return std::make_unique<LockstepDrive>(simulation);
  if (!options.publish_clock && ros::Time::isSimTime()) {
    return std::make_unique<FollowDrive>(options, simulation);
  }
  return std::make_unique<FreeDrive>(options, simulation);
}

}  // namespace walker
