// Format of `Specification::engine_version`:
//
//   RELEASE (ORIGIN), libm: VARIANT, levels: VARIANT, stepped by STEPPER
#pragma once

#include <string>

namespace walker {

/// Precedes the variant of the C library's sin, cos and pow; present if the engine's results depend
/// on it.
inline constexpr const char* kLibm = ", libm: ";
/// Precedes what levels are made of; absent: boxes.
inline constexpr const char* kLevels = ", levels: ";
/// Precedes the implementation that makes the steps. Results do not depend on it.
inline constexpr const char* kSteppedBy = ", stepped by ";

/// Returns RELEASE (ORIGIN).
inline std::string engine_release(const std::string& engine_version) {
  const std::string text = engine_version.substr(0, engine_version.find(kSteppedBy));
  return text.substr(0, text.find(kLibm));
}

/// Returns the VARIANT of a key, which is `kLibm` or `kLevels`, or `absent` if the version lacks
/// it.
inline std::string variant_of(const std::string& engine_version, const std::string& key,
                              const std::string& absent = "") {
  const std::string text = engine_version.substr(0, engine_version.find(kSteppedBy));
  const std::size_t at = text.find(key);
  if (at == std::string::npos) return absent;
  const std::size_t begin = at + key.size();
  return text.substr(begin, text.find(", ", begin) - begin);
}

}  // namespace walker
