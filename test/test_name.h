// Names of parametrised tests.
#pragma once

#include <string>

namespace walker {

/// Returns the id without its hyphen, which GoogleTest does not allow.
inline std::string test_name(std::string id) { return id.erase(id.find('-'), 1); }

/// Names an instance by its parameter, an id.
inline const auto kNameOfId = [](const auto& instance) { return test_name(instance.param); };

}  // namespace walker
