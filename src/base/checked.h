// Failures of system calls as exceptions.
#pragma once

#include <cerrno>
#include <system_error>

namespace walker {

/// @param result of a system call that says -1, with the cause in errno, where it has failed
/// @param what   stands before the cause
/// @throws std::system_error
inline int checked(int result, const char* what) {
  if (result < 0) throw std::system_error(errno, std::generic_category(), what);
  return result;
}

}  // namespace walker
