#include "mujoco/physics.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace walker::mujoco {

Physics::Physics(ModelPointer model) : model_(std::move(model)), data_(mj_makeData(model_.get())) {
  if (!data_) throw std::runtime_error("MuJoCo could not allocate the simulation's state");
}

void Physics::reset(const double* position, const double* velocity) {
  mj_resetData(model_.get(), data_.get());
  std::copy_n(position, model_->nq, data_->qpos);
  std::copy_n(velocity, model_->nv, data_->qvel);
  mj_forward(model_.get(), data_.get());
}

void Physics::step(const double* control, int count) {
  std::copy_n(control, model_->nu, data_->ctrl);
  for (int i = 0; i < count; ++i) mj_step(model_.get(), data_.get());
  // A step looks at the state from which it starts; the last one's result has yet to be looked at.
  mj_checkPos(model_.get(), data_.get());
  mj_checkVel(model_.get(), data_.get());
  check_warnings();
}

/// MuJoCo answers a bad state with a warning and the initial state. A reset clears the warnings.
void Physics::check_warnings() const {
  for (const int warning : {mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC, mjWARN_BADCTRL}) {
    const mjWarningStat& statistics = data_->warning[warning];
    if (statistics.number != 0) {
      throw std::runtime_error(std::string("MuJoCo: ") +
                               mju_warningText(warning, statistics.lastinfo));
    }
  }
}

void Physics::measure() {
  mj_kinematics(model_.get(), data_.get());
  mj_collision(model_.get(), data_.get());
}

}  // namespace walker::mujoco
