// The classes of the module walker_sim._core, and how they let Python go on while the core works.
#pragma once

#include <pybind11/pybind11.h>

#include <mutex>

namespace walker::python {

// Each adds to the module what its source file binds. walker_sim/_core.pyi names the arguments.
void bind_client(pybind11::module& module);
void bind_environment(pybind11::module& module);
void bind_policy(pybind11::module& module);
void bind_pool(pybind11::module& module);
void bind_renderer(pybind11::module& module);

/// Lets go of the interpreter's lock, then waits for the mutex, whose owner may want the former.
class Unlocked {
 public:
  explicit Unlocked(std::mutex& mutex) : lock_(mutex) {}

 private:
  pybind11::gil_scoped_release release_;
  std::lock_guard<std::mutex> lock_;
};

}  // namespace walker::python
