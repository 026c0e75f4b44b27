// Run-time loading of the libraries that only rendering needs.
#pragma once

#include <string>

namespace walker {

/// A system library loaded with dlopen. It is never unloaded.
class SharedLibrary {
 public:
  /// @param file    name for the dynamic loader, e.g. libcairo.so.2
  /// @param package of the distribution, for the error message
  /// @throws std::runtime_error naming the package to install
  SharedLibrary(const char* file, const char* package);

  /// Makes the library's symbols visible to the whole process (RTLD_GLOBAL).
  void make_global() const;

  /// A function's address; converts to any function pointer type, e.g. decltype(&cairo_create).
  struct Function {
    void* address;

    template <typename Type>
    operator Type*() const {
      return reinterpret_cast<Type*>(address);
    }
  };

  /// Looks up a function. @throws std::runtime_error if the library does not have it
  Function function(const char* name) const;

 private:
  void* handle_;
  std::string file_;
};

}  // namespace walker
