#include "hopper/gait.h"

namespace walker::hopper {

const std::vector<mujoco::MotorWeights>& gait() {
  static const std::vector<mujoco::MotorWeights> kMotors{
      {-0.79736,
       {0.38921, -3.0115, -0.27563, 0.68445, -0.22567, 0.23987, -0.10152, -0.33925, -0.083277,
        0.04064, -0.025828}},  // thigh_joint
      {0.4402,
       {-0.7317, -2.9283, -0.40995, -1.034, 0.046376, 0.085682, 0.0082116, -0.38687, -0.053378,
        -0.17602, -0.020426}},  // leg_joint
      {-2.1981,
       {2.4008, -3.5984, 0.44211, -0.032361, -0.080808, -0.53917, 0.0037326, 0.14534, 0.14014,
        0.007087, 0.017716}},  // foot_joint
  };
  return kMotors;
}

}  // namespace walker::hopper
