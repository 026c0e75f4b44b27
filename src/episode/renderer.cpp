#include "walker_sim/renderer.h"

#include <algorithm>
#include <string>

namespace walker {

void capture(Environment& environment, std::uint32_t step, StateCapture& captured) {
  try {
    environment.sense(captured.sensors);
  } catch (const ResetNeeded& error) {
    const std::string words = error.what();  // of `sense`, for which nobody has asked
    throw ResetNeeded("render" + words.substr(std::min(words.find(':'), words.size())));
  }
  environment.scene(captured.scene);
  captured.step = step;
}

}  // namespace walker
