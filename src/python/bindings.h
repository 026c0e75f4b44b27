// The classes of the module walker_sim._core, and how they let Python go on while the core works.
#pragma once

#include <pybind11/pybind11.h>
#include <unistd.h>

#include <mutex>

namespace walker::python {

// Each adds to the module what its source file binds. walker_sim/_core.pyi names the arguments.
void bind_client(pybind11::module& module);
void bind_environment(pybind11::module& module);
void bind_policy(pybind11::module& module);
void bind_pool(pybind11::module& module);
void bind_renderer(pybind11::module& module);

/// The state of this thread while it has released the interpreter's lock.
inline thread_local PyThreadState* released_state = nullptr;

/// Takes the interpreter's lock again.
///
/// If Python is ending, its lock is no other thread's any more: up to Python 3.13
/// PyEval_RestoreThread ends the calling thread by pthread_exit, whose unwinding std::terminate
/// meets at the first destructor. As in Python 3.14, the thread then blocks until the process ends.
inline void take_interpreter_lock(PyThreadState* state) {
  try {
    PyEval_RestoreThread(state);
  } catch (...) {  // abi::__forced_unwind, which must not be left
    while (true) pause();
  }
}

/// Releases the interpreter's lock while this lives.
class Released {
 public:
  Released() : state_(PyEval_SaveThread()) { released_state = state_; }
  Released(const Released&) = delete;
  Released& operator=(const Released&) = delete;
  ~Released() { take_interpreter_lock(state_); }

 private:
  PyThreadState* state_;
};

/// Holds the interpreter's lock while this lives, in a thread that has released it.
class Acquired {
 public:
  Acquired() { take_interpreter_lock(released_state); }
  Acquired(const Acquired&) = delete;
  Acquired& operator=(const Acquired&) = delete;
  ~Acquired() { PyEval_SaveThread(); }
};

/// Releases the interpreter's lock, then waits for the mutex, whose owner may want the former.
class Unlocked {
 public:
  explicit Unlocked(std::mutex& mutex) : lock_(mutex) {}

 private:
  Released released_;
  std::lock_guard<std::mutex> lock_;
};

}  // namespace walker::python
