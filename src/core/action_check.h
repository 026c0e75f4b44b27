// Which actions are well-formed.
#pragma once

#include <cstddef>
#include <string>

#include "walker_sim/export.h"
#include "walker_sim/specification.h"

namespace walker {

/// @param action `size` values
/// @param whose  stands before the message, e.g. "environment 3: "
/// @param what, unit how the message calls them
/// @throws InvalidAction when there is not one finite value per joint
WALKER_SIM_EXPORT void check_action(const Specification& specification, const double* action,
                                    std::size_t size, const std::string& whose = {},
                                    const char* what = "action", const char* unit = "");

}  // namespace walker
