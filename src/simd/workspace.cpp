#include "simd/workspace.h"

#include <memory>

namespace walker::simd {

Workspace& workspace() {
  // Only the pointer is thread-local: the C library takes thread-local memory from the stack.
  // NOLINTNEXTLINE(modernize-make-unique)  // make_unique would zero all of it
  thread_local const std::unique_ptr<Workspace> kWorkspace(new Workspace);
  return *kWorkspace;
}

}  // namespace walker::simd
