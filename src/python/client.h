// A server on a ROS master, as Python sees it.
#pragma once

#include <pybind11/pybind11.h>

namespace walker::python {

/// Adds the class to the module.
void bind_client(pybind11::module& module);

}  // namespace walker::python
