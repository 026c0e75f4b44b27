// Format of `Specification::engine_version`:
//
//   RELEASE (ORIGIN), libm: VARIANT, stepped by STEPPER
#pragma once

#include <string>

namespace walker {

/// Precedes the variant of the C library's sin, cos and pow; present if the engine's results depend
/// on it.
inline constexpr const char* kLibm = ", libm: ";
/// Precedes the implementation that makes the steps. Results do not depend on it.
inline constexpr const char* kSteppedBy = ", stepped by ";

/// Returns RELEASE (ORIGIN).
inline std::string engine_release(const std::string& engine_version) {
  const std::string text = engine_version.substr(0, engine_version.find(kSteppedBy));
  return text.substr(0, text.find(kLibm));
}

/// Returns VARIANT; empty if there is none.
inline std::string libm_of(const std::string& engine_version) {
  const std::string text = engine_version.substr(0, engine_version.find(kSteppedBy));
  const std::size_t at = text.find(kLibm);
  return at == std::string::npos ? "" : text.substr(at + std::string(kLibm).size());
}

}  // namespace walker
