// The agents that the ROS nodes run, as Python sees them.
#pragma once

#include <pybind11/pybind11.h>

namespace walker::python {

/// Adds the class to the module.
void bind_policy(pybind11::module& module);

}  // namespace walker::python
