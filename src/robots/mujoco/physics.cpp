#include "robots/mujoco/physics.h"

#include <algorithm>

namespace walker::mujoco {

void Physics::step_together(PhysicsCall* calls, std::size_t num_calls, int count) noexcept {
  std::for_each(calls, calls + num_calls, [count](PhysicsCall& call) {
    try {
      call.physics->step(call.control, count);
    } catch (...) {
      call.failure = std::current_exception();
    }
  });
}

std::size_t Physics::state_size() const {
  const mjModel& m = model();
  const auto size = [](int count) { return static_cast<std::size_t>(count); };
  return size(m.nq) + 3 * size(m.nv) + size(m.nu);
}

}  // namespace walker::mujoco
