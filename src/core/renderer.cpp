#include "walker_sim/renderer.h"

namespace walker {

void look(Environment& environment, std::uint32_t step, Instant& instant) {
  environment.sense(instant.sensors);
  environment.scene(instant.scene);
  instant.step = step;
}

}  // namespace walker
