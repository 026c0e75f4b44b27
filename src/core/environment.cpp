#include "walker_sim/environment.h"

namespace walker {

void Environment::step_together(StepCall* const* calls, std::size_t count,
                                std::size_t size) noexcept {
  for (StepCall* const* call = calls; call != calls + count; ++call) {
    try {
      (*call)->environment->step((*call)->action, size, *(*call)->result);
    } catch (...) {
      (*call)->failure = std::current_exception();
    }
  }
}

}  // namespace walker
