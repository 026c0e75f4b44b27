#include "walker_sim/renderer.h"

namespace walker {

void capture(Environment& environment, std::uint32_t step, StateCapture& captured) {
  environment.sense(captured.sensors);
  environment.scene(captured.scene);
  captured.step = step;
}

}  // namespace walker
