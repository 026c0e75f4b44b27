// Calls of the operating system: errors, file descriptors, forks, the user's paths.
#pragma once

#include <fcntl.h>
#include <pthread.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <string>
#include <system_error>

namespace walker {

/// @param result of a system call, negative if it failed and set errno
/// @param what   prefix of the error message
/// @throws std::system_error if the call failed
inline int checked(int result, const char* what) {
  if (result < 0) throw std::system_error(errno, std::generic_category(), what);
  return result;
}

/// Opens /dev/null on each of the descriptors 0, 1 and 2 that is closed. Otherwise the next file or
/// socket gets its number, and receives what libraries print. A node's main() calls it first.
inline void open_standard_descriptors() {
  int descriptor = 0;
  do {
    descriptor = open("/dev/null", O_RDWR);  // takes the lowest free descriptor
  } while (descriptor >= 0 && descriptor <= STDERR_FILENO);
  if (descriptor >= 0) close(descriptor);
}

/// Moves a file descriptor above stderr's, for processes that have closed their standard ones.
/// @param descriptor a negative value is returned unchanged
/// @return the new descriptor, close-on-exec; -1 with errno on failure
inline int above_standard(int descriptor) {
  if (descriptor < 0 || descriptor > STDERR_FILENO) return descriptor;
  const int moved = fcntl(descriptor, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  const int error = errno;
  close(descriptor);
  errno = error;
  return moved;
}

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
    "this client was made before a fork, and its connections belong to the parent process; make "
    "another client in this process";

/// Whether the path names another kind of file than a regular one. Reading a FIFO, for example,
/// blocks until there is a writer, and in most libraries no signal ends that.
/// @return false also if there is no such file
inline bool is_irregular_file(const std::string& path) {
  struct stat status {};
  return stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode);
}

/// Replaces a leading ~/ by $HOME/, if HOME is set. roslaunch passes arguments on unexpanded.
inline std::string expand_home(const std::string& path) {
  const char* const home = std::getenv("HOME");  // NOLINT(concurrency-mt-unsafe): nobody sets it
  return path.rfind("~/", 0) == 0 && home != nullptr ? home + path.substr(1) : path;
}

}  // namespace walker
