#include "core/action_check.h"

#include <cmath>

#include "walker_sim/environment.h"

namespace walker {

void check_action(const Specification& specification, const double* action, std::size_t size,
                  const std::string& whose, const char* what, const char* unit) {
  const std::size_t expected = specification.action_size();
  if (size != expected) {
    throw InvalidAction(whose + what + " has " + std::to_string(size) + " values; must have " +
                        std::to_string(expected) + ", one per joint");
  }
  for (std::size_t i = 0; i < size; ++i) {
    if (!std::isfinite(action[i])) {
      throw InvalidAction(whose + what + "[" + std::to_string(i) + "] (" +
                          specification.joints[i].name + ") = " + std::to_string(action[i]) + unit +
                          "; must be finite");
    }
  }
}

}  // namespace walker
