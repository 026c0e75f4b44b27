#include "robots/bipedal_walker/together.h"

#include "robots/bipedal_walker/physics.h"

namespace walker::bipedal_walker {

void step_together(const Kernel& /*kernel*/, WorldCall* calls, std::size_t count) noexcept {
  for (WorldCall* call = calls; call != calls + count; ++call) {
    try {
      call->physics->step();
    } catch (...) {
      call->failure = std::current_exception();
    }
  }
}

}  // namespace walker::bipedal_walker
