// Whether this process is still the one that made something.
#pragma once

namespace walker {

/// How many forks this process has come out of since the first call, in it or before: a number that
/// differs from an earlier one says that this is a child of the process in which that was asked
/// for. Costs no system call.
unsigned num_forks();

/// What a client says in the child of a fork.
inline constexpr const char* kForked =
    "this client was made before a fork, by the parent process, whose connections it has; make "
    "another one in this process";

}  // namespace walker
