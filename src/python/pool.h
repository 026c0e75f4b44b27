// Many walkers in this process, as Python sees them.
#pragma once

#include <pybind11/pybind11.h>

namespace walker::python {

/// Adds the class to the module.
void bind_pool(pybind11::module& module);

}  // namespace walker::python
