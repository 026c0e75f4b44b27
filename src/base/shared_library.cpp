#include "base/shared_library.h"

#include <dlfcn.h>

#include <stdexcept>

namespace walker {

SharedLibrary::SharedLibrary(const char* file, const char* package)
    : handle_(dlopen(file, RTLD_NOW | RTLD_LOCAL)), file_(file) {
  if (handle_ != nullptr) return;
  throw std::runtime_error(file_ + " cannot be loaded (" + dlerror() + "); install the package " +
                           package);
}

void SharedLibrary::make_global() const {
  dlopen(file_.c_str(), RTLD_NOW | RTLD_GLOBAL | RTLD_NOLOAD);
}

SharedLibrary::Function SharedLibrary::function(const char* name) const {
  void* const found = dlsym(handle_, name);
  if (found == nullptr) throw std::runtime_error(file_ + " has no function " + name);
  return {found};
}

}  // namespace walker
