// The core through plain C functions, for a test that steps it in one process with Gymnasium.
#include "stepper.h"

namespace {

walker::Stepper& walker_here() {
  static walker::Stepper stepper("BipedalWalker-v3");
  return stepper;
}

}  // namespace

extern "C" {

/// Resets; `observation` has 24 values.
WALKER_SIM_EXPORT void walker_sim_test_reset(unsigned long seed, double* observation) {
  walker::Stepper& walker = walker_here();
  walker.result.observation = observation;
  walker.reset(seed);
}

/// Steps; `action` has 4 values, `row` 27: observation, reward, terminated, truncated.
WALKER_SIM_EXPORT void walker_sim_test_step(const double* action, double* row) {
  walker::Stepper& walker = walker_here();
  walker.result.observation = row;
  walker.environment->step(action, walker.environment->specification().action_size(),
                           walker.result);
  row += walker.observation.size();
  row[0] = walker.result.reward;
  row[1] = walker.result.terminated ? 1 : 0;
  row[2] = walker.result.truncated ? 1 : 0;
}
}
