// What draws walkers, as Python sees it.
#pragma once

#include <pybind11/pybind11.h>

namespace walker::python {

/// Adds the classes to the module.
void bind_renderer(pybind11::module& module);

}  // namespace walker::python
