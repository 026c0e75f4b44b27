#include "core/shared_library.h"

#include <dlfcn.h>

#include <stdexcept>

namespace walker {

// Where all can see it: MuJoCo looks for OpenGL among the functions of the whole process.
SharedLibrary::SharedLibrary(const char* file, const char* package)
    : handle_(dlopen(file, RTLD_NOW | RTLD_GLOBAL)), file_(file) {
  if (handle_ != nullptr) return;
  throw std::runtime_error(file_ + " cannot be loaded (" + dlerror() + "); install the package " +
                           package);
}

void* SharedLibrary::address(const char* name) const {
  void* const found = dlsym(handle_, name);
  if (found == nullptr) throw std::runtime_error(file_ + " has no function " + name);
  return found;
}

}  // namespace walker
