// Steps of many worlds, made together.
#pragma once

#include <cstddef>
#include <exception>

#include "base/limits.h"
#include "robots/bipedal_walker/kernel/kernel.h"

namespace walker::bipedal_walker {

class Physics;

/// One of several calls of `Physics::step` that are made together.
struct WorldCall {
  Physics* physics = nullptr;
  std::exception_ptr failure;  ///< what `step` would have thrown
};

/// Advances distinct worlds by a step, each as `Physics::step` does it, to the bit.
/// @param count at most kMaxGroupSize
void step_together(const Kernel& kernel, WorldCall* calls, std::size_t count) noexcept;

}  // namespace walker::bipedal_walker
