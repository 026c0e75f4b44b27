#include "robots/mujoco/kernel/kernel_physics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/limits.h"
#include "robots/mujoco/model_pool.h"
#include "robots/mujoco/planar_model.h"
#include "robots/mujoco/world_physics.h"

namespace walker::mujoco::kernel {
namespace {

struct Data {
  explicit Data(const mjModel& model) : pointer(make_data(model)) {}

  DataPointer pointer;
};

using DataPool = ModelPool<Data>;

/// What walkers with the same base model share.
struct Shared {
  explicit Shared(const ModelPointer& base)
      : values(values_of(*base)),
        data(base),
        level_data(WorldModels(base).model_of(physics_of({{"ground_roughness", 1}}))) {}

  ModelValues<double> values;  ///< of the base model
  DataPool data;               ///< for models of all instances without a level
  DataPool level_data;         ///< for those with one, which have other sizes
};

/// An instance that a kernel steps. The control becomes torques, as in mj_fwdActuation,
///
///   torque_i = gear_i * clamp(control_i, ctrlrange_i)   [N m]
///
/// and the push a force on the trunk's slides. Before a step the instance is copied. If the kernel
/// flags the result, or there are wrenches or a control beyond mjMAXVAL, the library makes the step
/// from the copy. State: `Instance` and the last control.
class KernelPhysics : public Physics {
 public:
  KernelPhysics(const Kernel& kernel, ModelPointer base)
      : kernel_(kernel),
        base_(std::move(base)),
        shared_(shared_by_users_of<Shared>(base_)),
        model_(base_) {
    instance_.values = &shared_->values;
  }

  const mjModel& model() const override { return *model_; }

  void set_model(ModelPointer model) override {
    if (model == model_) return;
    own_values_ =
        model == base_ ? nullptr : std::make_unique<ModelValues<double>>(values_of(*model));
    instance_.values = own_values_ ? own_values_.get() : &shared_->values;
    model_ = std::move(model);
  }

  void set_ground(const GroundLine* line) override { instance_.line = line; }

  const double* position() const override { return instance_.position.data(); }
  const double* velocity() const override { return instance_.velocity.data(); }

  void reset(const double* position, const double* velocity) override {
    std::copy_n(position, model_->nq, instance_.position.begin());
    std::copy_n(velocity, model_->nv, instance_.velocity.begin());
    control_ = {};
    kernel_.start(instance_);
    if (!instance_.is_flagged) return;
    const GroundInUse ground(instance_.line);
    const DataPool::Loan loan(data_pool());
    mjData& data = *loan->pointer;
    mj_resetData(model_.get(), &data);
    std::copy_n(position, model_->nq, data.qpos);
    std::copy_n(velocity, model_->nv, data.qvel);
    mj_forward(model_.get(), &data);
    read(data);
  }

  void step(const double* control, const ExternalForces& forces, int count) override {
    const Instance before = instance_;
    Instance* const instance = &instance_;
    if (take_inputs(control, forces)) kernel_.step_singly(&instance, 1, count);
    if (instance_.is_flagged) step_by_library(before, forces, count);
  }

  void step_together(PhysicsCall* calls, std::size_t num_calls, int count) noexcept override {
    std::array<KernelPhysics*, kMaxGroupSize> members{};
    std::array<Instance, kMaxGroupSize> before;
    std::array<Instance*, kMaxGroupSize> instances{};
    std::size_t num_instances = 0;
    for (std::size_t i = 0; i < num_calls; ++i) {
      members[i] = find_alike(calls[i]);
      if (members[i] == nullptr) {
        Physics::step_together(&calls[i], 1, count);
        continue;
      }
      before[i] = members[i]->instance_;
      if (members[i]->take_inputs(calls[i].control, calls[i].forces)) {
        instances[num_instances++] = &members[i]->instance_;
      }
    }
    // Instances with the same contacts are solved together fastest.
    std::sort(instances.begin(), instances.begin() + num_instances,
              [](const Instance* a, const Instance* b) { return a->pattern < b->pattern; });
    // A single remaining instance is faster alone than in a vector.
    const std::size_t num_alone = num_instances % kernel_.lanes == 1 ? 1 : 0;
    kernel_.step(instances.data(), num_instances - num_alone, count);
    kernel_.step_singly(instances.data() + num_instances - num_alone, num_alone, count);
    for (std::size_t i = 0; i < num_calls; ++i) {
      if (members[i] == nullptr || !members[i]->instance_.is_flagged) continue;
      try {
        members[i]->step_by_library(before[i], calls[i].forces, count);
      } catch (...) {
        calls[i].failure = std::current_exception();
      }
    }
  }

  std::size_t group_size() const override { return kMaxGroupSize; }

  void measure(const std::function<void(const mjData&)>& look) const override {
    const GroundInUse ground(instance_.line);
    const DataPool::Loan loan(data_pool());
    mjData& data = *loan->pointer;
    write(instance_, data);
    std::copy_n(control_.begin(), model_->nu, data.ctrl);
    mj_kinematics(model_.get(), &data);
    mj_collision(model_.get(), &data);
    mj_transmission(model_.get(), &data);
    mj_fwdActuation(model_.get(), &data);
    look(data);
  }

  void save(double* values) const override {
    values = std::copy_n(instance_.position.begin(), model_->nq, values);
    values = std::copy_n(instance_.velocity.begin(), model_->nv, values);
    values = std::copy_n(instance_.warm_start.begin(), model_->nv, values);
    values = std::copy_n(control_.begin(), model_->nu, values);
    values = std::fill_n(values, kBaseJoints, 0.0);  // the trunk has no motors
    // The library adds each torque to 0, which turns -0 into 0.
    std::transform(instance_.torque.begin(), instance_.torque.begin() + model_->nu, values,
                   [](double torque) { return 0.0 + torque; });
  }

  void load(const double* values) override {
    const double* next = values;
    const auto take = [&next](auto& to, int count) {
      std::copy_n(next, count, to.begin());
      next += count;
    };
    take(instance_.position, model_->nq);
    take(instance_.velocity, model_->nv);
    take(instance_.warm_start, model_->nv);
    take(control_, model_->nu);
    next += kBaseJoints;
    take(instance_.torque, model_->nu);
  }

  std::string stepper() const override {
    return std::string("the kernel for ") + kernel_.instruction_set;
  }

 private:
  /// Returns the call's instance if it has the same kernel and base model, else null: between the
  /// creation of two environments the user may have changed the model's file or selected another
  /// kernel.
  KernelPhysics* find_alike(const PhysicsCall& call) const {
    auto* const other = dynamic_cast<KernelPhysics*>(call.physics);
    const bool is_alike = other != nullptr && &other->kernel_ == &kernel_ && other->base_ == base_;
    return is_alike ? other : nullptr;
  }

  /// mj_fwdActuation. @return whether the kernel can make the step; if not, the instance is flagged
  bool take_inputs(const double* control, const ExternalForces& forces) {
    instance_.push = forces.trunk;
    std::copy_n(control, model_->nu, control_.begin());
    // The kernel applies no wrenches.
    instance_.is_flagged = forces.wrenches != nullptr ||
                           !std::all_of(control_.begin(), control_.end(),
                                        [](double value) { return std::abs(value) <= mjMAXVAL; });
    for (int motor = 0; motor < model_->nu; ++motor) {
      const double* const range = at(model_->actuator_ctrlrange, motor, 2);
      instance_.torque[motor] =
          at(model_->actuator_gear, motor, 6)[0] * std::clamp(control_[motor], range[0], range[1]);
    }
    return !instance_.is_flagged;
  }

  DataPool& data_pool() const {
    return model_->nconmax == base_->nconmax ? shared_->data : shared_->level_data;
  }

  /// @throws as `step`
  void step_by_library(const Instance& before, const ExternalForces& forces, int count) {
    const GroundInUse ground(instance_.line);
    const DataPool::Loan loan(data_pool());
    mjData& data = *loan->pointer;
    mj_resetData(model_.get(), &data);
    write(before, data);
    advance(*model_, data, control_.data(), forces, count);
    read(data);
    check_warnings(data);
  }

  void write(const Instance& instance, mjData& data) const {
    std::copy_n(instance.position.begin(), model_->nq, data.qpos);
    std::copy_n(instance.velocity.begin(), model_->nv, data.qvel);
    std::copy_n(instance.warm_start.begin(), model_->nv, data.qacc_warmstart);
  }

  void read(const mjData& data) {
    read_state(*model_, data, instance_);
    std::copy_n(data.ctrl, model_->nu, control_.begin());
  }

  const Kernel& kernel_;
  ModelPointer base_;
  std::shared_ptr<Shared> shared_;
  ModelPointer model_;                               // of this instance
  std::unique_ptr<ModelValues<double>> own_values_;  // if the model is not the base model
  Instance instance_;
  std::array<double, kMaxMotors> control_{};
};

}  // namespace

const GroundLine& flat_floor() {
  static const GroundLine kFloor({{0, 0}});
  return kFloor;
}

std::unique_ptr<Physics> make_physics(const Kernels& kernels, ModelPointer model) {
  const KernelChoice choice = choose_kernel(kernels, *model);
  if (choice.kernel == nullptr) {
    return std::make_unique<LibraryPhysics>(std::move(model), choice.fallback_reason);
  }
  return std::make_unique<KernelPhysics>(*choice.kernel, std::move(model));
}

}  // namespace walker::mujoco::kernel
