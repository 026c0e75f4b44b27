// Libraries that only pictures need: looked for when the first one is drawn.
#pragma once

#include <string>

namespace walker {

/// A library of the system's, loaded while the process runs. It stays loaded.
class SharedLibrary {
 public:
  /// @param file    as the loader looks for it, e.g. libcairo.so.2
  /// @param package of the distribution, for the error
  /// @throws std::runtime_error saying what to install
  SharedLibrary(const char* file, const char* package);

  /// Lets the whole process find its functions by name.
  void make_global() const;

  /// A function that becomes a pointer of the type it is asked for in, e.g.
  /// decltype(&cairo_create).
  struct Function {
    void* address;

    template <typename Type>
    operator Type*() const {
      return reinterpret_cast<Type*>(address);
    }
  };

  /// The function of this name. @throws std::runtime_error where the library has none
  Function function(const char* name) const;

 private:
  void* handle_;
  std::string file_;
};

}  // namespace walker
