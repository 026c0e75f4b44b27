// How long the tests are whose length a user may choose.
#pragma once

#include <cstdlib>

namespace walker {

/// Returns the steps that WALKER_SIM_TEST_STEPS names.
inline long num_test_steps(long absent) {
  const char* const text = std::getenv("WALKER_SIM_TEST_STEPS");
  return text != nullptr ? std::strtol(text, nullptr, 10) : absent;
}

}  // namespace walker
