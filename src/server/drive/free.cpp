#include "server/drive/free.h"

namespace walker {

FreeDrive::FreeDrive(const ServerOptions& options, Simulation& simulation)
    : RunningDrive(options, simulation),
      pacer_(simulation.shown().specification().dt, options.real_time_factor) {}

void FreeDrive::start() {
  begin_episode(std::nullopt);
  restart_schedule();
}

void FreeDrive::restart_schedule() {
  RunningDrive::restart_schedule();
  pacer_.restart(Clock::now());
}

void FreeDrive::step_if_due(Clock::time_point now) {
  if (pacer_.remaining(now) > Clock::duration::zero()) return;
  simulation_.timing().step_begins(now, pacer_.period());
  simulation_.counters().missed_deadlines += pacer_.step_begins(now);
  step();
}

void FreeDrive::set_real_time_factor(double factor) {
  complete_parameters(server_parameters(), {{"real_time_factor", factor}});  // throws
  pacer_.set_real_time_factor(factor, Clock::now());
  simulation_.timing().interrupt();
  simulation_.command().count_in_wall_time(factor == 0, simulation_.clock().now().toNSec());
}

const char* FreeDrive::pace() const {
  if (is_paused()) return "paused";
  return pacer_.real_time_factor() == 0 ? "as fast as it goes" : "keeps up";
}

}  // namespace walker
