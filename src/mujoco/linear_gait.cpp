#include "mujoco/linear_gait.h"

#include <algorithm>
#include <stdexcept>

namespace walker::mujoco {

LinearGait::LinearGait(const std::vector<MotorWeights>& motors, const Specification& specification)
    : motors_(motors), action_(motors.size()) {
  if (specification.observation_size() != motors.front().of_observation.size()) {
    throw std::invalid_argument("agent = heuristic: needs " + specification.id +
                                " with exclude_current_positions_from_observation = true");
  }
}

const std::vector<double>& LinearGait::act(const std::vector<double>& observation) {
  for (std::size_t motor = 0; motor < motors_.size(); ++motor) {
    double control = motors_[motor].constant;
    for (std::size_t i = 0; i < observation.size(); ++i) {
      control += motors_[motor].of_observation[i] * observation[i];
    }
    action_[motor] = double{static_cast<float>(std::clamp(control, -1.0, 1.0))};
  }
  return action_;
}

}  // namespace walker::mujoco
