// A gait without memory.
#pragma once

#include <vector>

#include "walker_sim/agent.h"

namespace walker::mujoco {

/// What one motor does.
struct MotorWeights {
  double constant;
  std::vector<double> of_observation;  ///< [1/m, 1/rad, s/m, s/rad]
};

/// Each motor's control is a weighted sum of the observed positions and velocities, limited to
/// [-1, 1].
class LinearGait : public Agent {
 public:
  /// @param motors in action order; all with the same number of weights
  /// @throws std::invalid_argument for an environment whose observations have another size
  LinearGait(const std::vector<MotorWeights>& motors, const Specification& specification);

  void reset() override {}
  const std::vector<double>& act(const std::vector<double>& observation) override;

 private:
  const std::vector<MotorWeights>& motors_;
  std::vector<double> action_;
};

}  // namespace walker::mujoco
