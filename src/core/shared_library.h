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

  /// The function of this name.
  /// @tparam Function its type, e.g. decltype(&cairo_create)
  /// @throws std::runtime_error where the library has none
  template <typename Function>
  Function function(const char* name) const {
    return reinterpret_cast<Function>(address(name));
  }

 private:
  void* address(const char* name) const;

  void* handle_;
  std::string file_;
};

}  // namespace walker
