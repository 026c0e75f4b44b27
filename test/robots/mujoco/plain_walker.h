// A robot in plain MuJoCo, as in Gymnasium's MujocoEnv.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "robots/mujoco/model.h"
#include "robots/mujoco/physics.h"
#include "robots/mujoco/player.h"

namespace walker::mujoco {

class PlainWalker {
 public:
  explicit PlainWalker(const std::string& xml_file) : model_(load_model(xml_file)) {}

  /// @param state positions, then velocities
  void set_state(const std::vector<double>& state) {
    std::copy_n(state.begin(), model_->nq, data_->qpos);
    std::copy_n(state.begin() + model_->nq, model_->nv, data_->qvel);
    mj_forward(model_.get(), data_.get());
  }

  void step(const std::vector<double>& action) {
    std::copy(action.begin(), action.end(), data_->ctrl);
    for (int i = 0; i < kFrameSkip; ++i) mj_step(model_.get(), data_.get());
  }

  const mjData& data() const { return *data_; }

  /// Data with poses and contacts of the current state; separate, so that the steps are unaffected.
  const mjData& shown() {
    std::copy_n(data_->qpos, model_->nq, shown_->qpos);
    std::copy_n(data_->qvel, model_->nv, shown_->qvel);
    mj_forward(model_.get(), shown_.get());
    return *shown_;
  }

  std::vector<double> observation() const {
    std::vector<double> values(data_->qpos, data_->qpos + model_->nq);
    for (int i = 0; i < model_->nv; ++i) values.push_back(std::clamp(data_->qvel[i], -10.0, 10.0));
    return values;
  }

 private:
  ModelPointer model_;
  DataPointer data_ = make_data(*model_);
  DataPointer shown_ = make_data(*model_);
};

}  // namespace walker::mujoco
