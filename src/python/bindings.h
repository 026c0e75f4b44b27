// Binding functions of the module walker_sim._core, and guards that release the GIL.
#pragma once

#include <pybind11/pybind11.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "base/interruption.h"

namespace walker::python {

// Each binds the classes of one source file. walker_sim/_core.pyi has their signatures.
void bind_client(pybind11::module& module);
void bind_drawing(pybind11::module& module);
void bind_renderer(pybind11::module& module);
void bind_policy(pybind11::module& module);
void bind_pool(pybind11::module& module);

/// The saved state of this thread while it does not hold the GIL.
inline thread_local PyThreadState* released_state = nullptr;

/// Takes the GIL again, in a thread that has released it.
///
/// While Python finalizes, PyEval_RestoreThread of Python 3.13 and earlier calls pthread_exit, and
/// the forced unwinding ends in std::terminate at the first destructor. This function catches the
/// unwinding and, as Python 3.14 does, blocks the thread until the process ends.
inline void acquire_gil() {
  try {
    PyEval_RestoreThread(released_state);
  } catch (...) {  // abi::__forced_unwind; leaving the handler would abort the process
    while (true) pause();
  }
}

/// Releases the GIL during its lifetime.
class GilRelease {
 public:
  GilRelease() { released_state = PyEval_SaveThread(); }
  GilRelease(const GilRelease&) = delete;
  GilRelease& operator=(const GilRelease&) = delete;
  ~GilRelease() {
    acquire_gil();
    released_state = nullptr;
  }
};

/// Takes the GIL again during its lifetime, within that of a `GilRelease` of the same thread.
class GilHold {
 public:
  GilHold() { acquire_gil(); }
  GilHold(const GilHold&) = delete;
  GilHold& operator=(const GilHold&) = delete;
  ~GilHold() { released_state = PyEval_SaveThread(); }
};

/// Serialises the calls of one object.
class CallMutex {
 public:
  /// Locks the mutex during its lifetime. Make it without the GIL: the mutex's owner may be waiting
  /// for the GIL.
  class Lock {
   public:
    /// @throws Interrupted if a signal handler has raised meanwhile; std::runtime_error if this
    ///         thread has the lock: a signal handler or a callback runs within the object's call
    explicit Lock(CallMutex& mutex) : mutex_(mutex), lock_(mutex.mutex_, std::defer_lock) {
      constexpr std::chrono::milliseconds kCheckInterval{50};
      if (mutex.owner_ == std::this_thread::get_id()) {
        throw std::runtime_error(
            "called by a signal handler or a callback during another call of the same object");
      }
      if (!lock_.try_lock()) {
        while (!lock_.try_lock_for(kCheckInterval)) check_interruption();
      }
      mutex.owner_ = std::this_thread::get_id();
    }
    Lock(const Lock&) = delete;
    Lock& operator=(const Lock&) = delete;
    ~Lock() { mutex_.owner_ = std::thread::id(); }

   private:
    CallMutex& mutex_;
    std::unique_lock<std::timed_mutex> lock_;
  };

 private:
  std::timed_mutex mutex_;
  std::atomic<std::thread::id> owner_{std::thread::id()};
};

/// Releases the GIL, then locks the mutex: the mutex's owner may be waiting for the GIL.
class GilFreeLock {
 public:
  /// @throws as CallMutex::Lock
  explicit GilFreeLock(CallMutex& mutex) : lock_(mutex) {}

 private:
  GilRelease released_;
  CallMutex::Lock lock_;
};

}  // namespace walker::python
