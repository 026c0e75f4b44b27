#include "robots/mujoco/library_physics.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <stdexcept>
#include <utility>

namespace walker::mujoco {
namespace {

void save_data(const mjModel& m, const mjData& data, double* values) {
  values = std::copy_n(data.qpos, m.nq, values);
  values = std::copy_n(data.qvel, m.nv, values);
  values = std::copy_n(data.qacc_warmstart, m.nv, values);
  values = std::copy_n(data.ctrl, m.nu, values);
  std::copy_n(data.qfrc_actuator, m.nv, values);
}

void load_data(const mjModel& m, mjData& data, const double* values) {
  mj_resetData(&m, &data);  // also clears the warnings
  const double* next = values;
  const auto take = [&next](double* to, int count) {
    std::copy_n(next, count, to);
    next += count;
  };
  take(data.qpos, m.nq);
  take(data.qvel, m.nv);
  take(data.qacc_warmstart, m.nv);
  take(data.ctrl, m.nu);
  take(data.qfrc_actuator, m.nv);
}

}  // namespace

LibraryPhysics::LibraryPhysics(ModelPointer model, std::string fallback_reason)
    : model_(std::move(model)),
      data_(make_data(*model_)),
      fallback_reason_(std::move(fallback_reason)) {}

void LibraryPhysics::reset(const double* position, const double* velocity) {
  mj_resetData(model_.get(), data_.get());
  std::copy_n(position, model_->nq, data_->qpos);
  std::copy_n(velocity, model_->nv, data_->qvel);
  mj_forward(model_.get(), data_.get());
}

void LibraryPhysics::step(const double* control, int count) {
  advance(*model_, *data_, control, count);
  check_warnings(*data_);
}

void LibraryPhysics::measure(const std::function<void(const mjData&)>& look) const {
  mj_kinematics(model_.get(), data_.get());
  mj_collision(model_.get(), data_.get());
  look(*data_);
}

void LibraryPhysics::save(double* values) const { save_data(*model_, *data_, values); }

void LibraryPhysics::load(const double* values) { load_data(*model_, *data_, values); }

std::string LibraryPhysics::stepper() const {
  return "the library" + (fallback_reason_.empty() ? "" : ": " + fallback_reason_);
}

DataPointer make_data(const mjModel& model) {
  DataPointer data(mj_makeData(&model));
  if (!data) throw std::runtime_error("MuJoCo could not allocate the simulation's state");
  return data;
}

void forward(const mjModel& model, double* state) {
  const DataPointer data = make_data(model);
  load_data(model, *data, state);
  mj_forward(&model, data.get());
  save_data(model, *data, state);
}

void advance(const mjModel& model, mjData& data, const double* control, int count) {
  std::copy_n(control, model.nu, data.ctrl);
  for (int i = 0; i < count; ++i) mj_step(&model, &data);
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

DataPool::DataPool(ModelPointer model) : model_(std::move(model)) {}

std::shared_ptr<DataPool> DataPool::of(const ModelPointer& model) {
  static std::mutex mutex;
  static std::map<const mjModel*, std::weak_ptr<DataPool>> all;
  const std::lock_guard<std::mutex> lock(mutex);
  for (auto each = all.begin(); each != all.end();) {
    each = each->second.expired() ? all.erase(each) : std::next(each);
  }
  std::weak_ptr<DataPool>& known = all[model.get()];
  std::shared_ptr<DataPool> pool = known.lock();
  if (!pool) {
    pool = std::make_shared<DataPool>(model);
    known = pool;
  }
  return pool;
}

DataPool::Loan::Loan(DataPool& pool) : pool_(pool) {
  {
    const std::lock_guard<std::mutex> lock(pool_.mutex_);
    if (!pool_.unused_.empty()) {
      data_ = std::move(pool_.unused_.back());
      pool_.unused_.pop_back();
    }
  }
  if (data_) return;
  data_ = make_data(pool_.model());
  const std::lock_guard<std::mutex> lock(pool_.mutex_);
  pool_.unused_.reserve(++pool_.num_made_);  // so that the destructor cannot fail
}

DataPool::Loan::~Loan() {
  const std::lock_guard<std::mutex> lock(pool_.mutex_);
  pool_.unused_.push_back(std::move(data_));
}

}  // namespace walker::mujoco
