// While the core works, Python may go on.
#pragma once

#include <pybind11/pybind11.h>

#include <mutex>

namespace walker::python {

/// Lets go of the interpreter's lock, then waits for the mutex, whose owner may want the former.
class Unlocked {
 public:
  explicit Unlocked(std::mutex& mutex) : lock_(mutex) {}

 private:
  pybind11::gil_scoped_release release_;
  std::lock_guard<std::mutex> lock_;
};

}  // namespace walker::python
