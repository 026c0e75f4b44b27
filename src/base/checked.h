// Converts failures of system calls to exceptions.
#pragma once

#include <cerrno>
#include <system_error>

namespace walker {

/// @param result of a system call, negative if it failed and set errno
/// @param what   prefix of the error message
/// @throws std::system_error if the call failed
inline int checked(int result, const char* what) {
  if (result < 0) throw std::system_error(errno, std::generic_category(), what);
  return result;
}

}  // namespace walker
