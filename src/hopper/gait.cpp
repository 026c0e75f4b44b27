#include "hopper/gait.h"

namespace walker::hopper {

const std::vector<mujoco::MotorWeights>& gait() {
  static const std::vector<mujoco::MotorWeights> kMotors{
      {0, std::vector<double>(11)}, {0, std::vector<double>(11)}, {0, std::vector<double>(11)}};
  return kMotors;
}

}  // namespace walker::hopper
