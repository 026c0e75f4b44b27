// C interface of the core, for tests that step it and Gymnasium in the same process.
#include <algorithm>

#include "stepper.h"

namespace {

walker::Stepper& stepper(void* walker) { return *static_cast<walker::Stepper*>(walker); }

}  // namespace

extern "C" {

/// Makes an environment with default parameters. It is never destroyed.
WALKER_SIM_EXPORT void* walker_sim_test_make(const char* id) { return new walker::Stepper(id); }

/// @param row receives observation, reward, terminated, truncated and info
WALKER_SIM_EXPORT void walker_sim_test_reset(void* walker, unsigned long seed, double* row) {
  stepper(walker).reset(seed);
  const std::vector<double> numbers = stepper(walker).row();
  std::copy(numbers.begin(), numbers.end(), row);
}

WALKER_SIM_EXPORT void walker_sim_test_step(void* walker, const double* action, double* row) {
  walker::Stepper& here = stepper(walker);
  here.environment->step(action, here.environment->specification().action_size(), here.result);
  const std::vector<double> numbers = here.row();
  std::copy(numbers.begin(), numbers.end(), row);
}
}
