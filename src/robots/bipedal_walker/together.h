// Steps many worlds together.
#pragma once

#include <cstddef>
#include <exception>

#include "base/limits.h"
#include "robots/bipedal_walker/kernel/kernel.h"

namespace walker::bipedal_walker {

class Physics;

/// One call of `Physics::step` within a group.
struct WorldCall {
  Physics* physics = nullptr;
  std::exception_ptr failure;  ///< what `step` would have thrown
};

/// Advances distinct worlds by one step. Each world gets the same bits as by `Physics::step`.
/// @param count at most kMaxGroupSize
void step_together(const Kernel& kernel, WorldCall* calls, std::size_t count) noexcept;

}  // namespace walker::bipedal_walker
