#include "robots/robot.h"

#include <stdexcept>

namespace walker {

void Robot::step_group(RobotStep* const* steps, std::size_t count) noexcept {
  for (RobotStep* const* each = steps; each != steps + count; ++each) {
    try {
      (*each)->robot->step(**each);
    } catch (...) {
      (*each)->failure = std::current_exception();
    }
  }
}

void Robot::set_coordinates(const std::vector<double>& /*position*/,
                            const std::vector<double>& /*velocity*/, double* /*info*/) {
  throw std::logic_error(specification().id +
                         " has no positions and velocities that can be set; load a saved state");
}

}  // namespace walker
