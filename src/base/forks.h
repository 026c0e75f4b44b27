// Detection of forks.
#pragma once

#include <pthread.h>

#include <atomic>

namespace walker {

/// Returns the number of forks between the process that made the first call and this one. If it
/// differs from a value stored earlier, this process is a child of the one that stored it. Makes no
/// system call.
inline unsigned num_forks() {
  static std::atomic<unsigned> forks{0};
  // Fails only without memory; forks are then not detected.
  [[maybe_unused]] static const int status = pthread_atfork(nullptr, nullptr, [] { ++forks; });
  return forks.load(std::memory_order_relaxed);
}

/// Error message of a client that is used in the child of a fork.
inline constexpr const char* kForkedClientError =
    "this client was made before a fork, by the parent process, whose connections it has; make "
    "another one in this process";

}  // namespace walker
