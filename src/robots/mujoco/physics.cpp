#include "robots/mujoco/physics.h"

#include <algorithm>
#include <stdexcept>

#include "robots/mujoco/planar_model.h"

namespace walker::mujoco {
namespace {

/// Calls use(values, size) for each part of a saved state, in the order of `Physics::save`.
template <typename Use>
void for_each_part(const mjModel& m, const mjData& data, const Use& use) {
  use(data.qpos, m.nq);
  use(data.qvel, m.nv);
  use(data.qacc_warmstart, m.nv);
  use(data.ctrl, m.nu);
  use(data.qfrc_actuator, m.nv);
}

void save_data(const mjModel& m, const mjData& data, double* values) {
  double* next = values;
  for_each_part(m, data,
                [&next](const double* part, int size) { next = std::copy_n(part, size, next); });
}

void load_data(const mjModel& m, mjData& data, const double* values) {
  mj_resetData(&m, &data);  // also clears the warnings
  const double* next = values;
  for_each_part(m, data, [&next](double* part, int size) {
    std::copy_n(next, size, part);
    next += size;
  });
}

/// Writes the wrenches as MuJoCo takes them, at the bodies' centres of mass.
void apply(const mjModel& m, const std::vector<BodyWrench>& wrenches, mjData& data) {
  mj_kinematics(&m, &data);
  std::fill_n(data.xfrc_applied, 6 * m.nbody, 0.0);
  for (const BodyWrench& wrench : wrenches) {
    double* const force = at(data.xfrc_applied, wrench.body, 6);
    std::array<double, 3> arm;
    std::array<double, 3> moment;
    mju_sub3(arm.data(), at(data.xpos, wrench.body, 3), at(data.xipos, wrench.body, 3));
    mju_cross(moment.data(), arm.data(), wrench.force.data());
    mju_addTo3(force, wrench.force.data());
    mju_addTo3(force + 3, moment.data());
    mju_addTo3(force + 3, wrench.torque.data());
  }
}

}  // namespace

void LibraryPhysics::set_model(ModelPointer model) {
  if (model->nconmax != model_->nconmax) data_ = make_data(*model);
  model_ = std::move(model);
}

void LibraryPhysics::reset(const double* position, const double* velocity) {
  const GroundInUse ground(line_);
  mj_resetData(model_.get(), data_.get());
  std::copy_n(position, model_->nq, data_->qpos);
  std::copy_n(velocity, model_->nv, data_->qvel);
  mj_forward(model_.get(), data_.get());
}

void LibraryPhysics::step(const double* control, const ExternalForces& forces, int count) {
  const GroundInUse ground(line_);
  advance(*model_, *data_, control, forces, count);
  check_warnings(*data_);
}

void LibraryPhysics::measure(const std::function<void(const mjData&)>& look) const {
  const GroundInUse ground(line_);
  mj_kinematics(model_.get(), data_.get());
  mj_collision(model_.get(), data_.get());
  look(*data_);
}

void LibraryPhysics::save(double* values) const { save_data(*model_, *data_, values); }

void LibraryPhysics::load(const double* values) { load_data(*model_, *data_, values); }

DataPointer make_data(const mjModel& model) {
  DataPointer data(mj_makeData(&model));
  if (!data) throw std::runtime_error("MuJoCo could not allocate the simulation's state");
  return data;
}

void forward(const mjModel& model, const GroundLine* line, double* state) {
  const GroundInUse ground(line);
  const DataPointer data = make_data(model);
  load_data(model, *data, state);
  mj_forward(&model, data.get());
  save_data(model, *data, state);
}

void advance(const mjModel& model, mjData& data, const double* control,
             const ExternalForces& forces, int count) {
  std::copy_n(control, model.nu, data.ctrl);
  data.qfrc_applied[kBaseX] = forces.trunk[0];
  data.qfrc_applied[kBaseZ] = forces.trunk[1];
  for (int i = 0; i < count; ++i) {
    if (forces.wrenches != nullptr) apply(model, *forces.wrenches, data);
    mj_step(&model, &data);
  }
  if (forces.wrenches != nullptr) std::fill_n(data.xfrc_applied, 6 * model.nbody, 0.0);
  // mj_step checks the state from which it starts, so the last result is still unchecked.
  mj_checkPos(&model, &data);
  mj_checkVel(&model, &data);
}

/// After a bad state, MuJoCo records a warning and continues from the initial state.
void check_warnings(const mjData& data) {
  for (const int warning : {mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC, mjWARN_BADCTRL}) {
    const mjWarningStat& statistics = data.warning[warning];
    if (statistics.number != 0) {
      throw std::runtime_error(std::string("MuJoCo: ") +
                               mju_warningText(warning, statistics.lastinfo));
    }
  }
}

}  // namespace walker::mujoco
