// Detection of forks.
#pragma once

namespace walker {

/// Returns the number of forks between the process that made the first call and this one. If it
/// differs from a value stored earlier, this process is a child of the one that stored it. Makes no
/// system call.
unsigned num_forks();

/// Error message of a client that is used in the child of a fork.
inline constexpr const char* kForked =
    "this client was made before a fork, by the parent process, whose connections it has; make "
    "another one in this process";

}  // namespace walker
