// What a client says in the child of a fork.
#pragma once

#include "base/forks.h"

namespace walker {

constexpr const char* kForked =
    "this client was made before a fork, by the parent process, whose connections it has; make "
    "another one in this process";

}  // namespace walker
