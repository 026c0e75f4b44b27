// A state that Python draws.
#pragma once

#include <memory>

#include "walker_sim/renderer.h"
#include "walker_sim/specification.h"

namespace walker::python {

/// Python's StateCapture: a captured state with its environment's specification, which the drawings
/// of the state need.
struct ShownState : StateCapture {
  std::shared_ptr<const Specification> specification;
};

}  // namespace walker::python
