// What of an engine's version decides about bits.
#pragma once

#include <string>

namespace walker {

/// Stands in `Specification::engine_version` between the release and what makes its steps.
inline constexpr const char* kSteppedBy = ", stepped by ";

/// Without what makes the steps, which no bit depends on.
inline std::string engine_release(const std::string& engine_version) {
  return engine_version.substr(0, engine_version.find(kSteppedBy));
}

}  // namespace walker
