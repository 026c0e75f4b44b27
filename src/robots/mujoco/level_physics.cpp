#include "robots/mujoco/level_physics.h"

#include <algorithm>
#include <utility>

namespace walker::mujoco {
namespace {

ModelPointer model_of(const std::shared_ptr<LevelModel>& level) { return {level, &level->model()}; }

}  // namespace

LevelPhysics::LevelPhysics(std::shared_ptr<LevelModel> level)
    : LibraryPhysics(model_of(level), make_data(level->largest())), level_(std::move(level)) {}

void LevelPhysics::set_course(std::shared_ptr<const Course> course) {
  course_ = std::move(course);
  level_->forget();
}

void LevelPhysics::set_model(ModelPointer source) {
  if (source == level_->source()) return;
  level_ = std::make_shared<LevelModel>(std::move(source));
  LibraryPhysics::set_model(model_of(level_));
}

void LevelPhysics::reset(const double* position, const double* velocity) {
  mjData& data = mutable_data();
  mj_resetData(&model(), &data);
  level_->forget();  // the boxes' poses are reset too
  std::copy_n(position, model().nq, data.qpos);
  std::copy_n(velocity, model().nv, data.qvel);
  level_->place(*course_, data);
  mj_forward(&model(), &data);
}

void LevelPhysics::step(const double* control, const ExternalForces& forces, int count) {
  for (int i = 0; i < count; ++i) {
    advance(level_->stepped(), mutable_data(), control, forces, 1);
    level_->place(*course_, mutable_data());
  }
  check_warnings(data());
}

void LevelPhysics::load(const double* values) {
  LibraryPhysics::load(values);
  level_->forget();
  level_->place(*course_, mutable_data());
}

}  // namespace walker::mujoco
