// The core through plain C functions, for a test that steps it in one process with Gymnasium.
#include <algorithm>

#include "stepper.h"

namespace {

walker::Stepper& stepper(void* walker) { return *static_cast<walker::Stepper*>(walker); }

}  // namespace

extern "C" {

/// An environment with its default parameters, kept to the end of the process.
WALKER_SIM_EXPORT void* walker_sim_test_make(const char* id) { return new walker::Stepper(id); }

/// Resets; `row` has room for observation, reward, terminated, truncated and info.
WALKER_SIM_EXPORT void walker_sim_test_reset(void* walker, unsigned long seed, double* row) {
  stepper(walker).reset(seed);
  const std::vector<double> numbers = stepper(walker).row();
  std::copy(numbers.begin(), numbers.end(), row);
}

/// Steps; `action` has as many values as the action space, `row` as above.
WALKER_SIM_EXPORT void walker_sim_test_step(void* walker, const double* action, double* row) {
  walker::Stepper& here = stepper(walker);
  here.environment->step(action, here.environment->specification().action_size(), here.result);
  const std::vector<double> numbers = here.row();
  std::copy(numbers.begin(), numbers.end(), row);
}
}
