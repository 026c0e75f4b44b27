#include "robots/walker2d/kernel/kernel_physics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <mutex>
#include <utility>
#include <vector>

#include "base/limits.h"

namespace walker::walker2d {
namespace {

/// Pool of mjData of one model. Its size is the maximum number of simultaneous loans, independent
/// of the number of worlds. Thread-safe.
class DataPool {
 public:
  explicit DataPool(mujoco::ModelPointer model) : model_(std::move(model)) {}

  /// Returns the pool that all users of this model share.
  static std::shared_ptr<DataPool> of(const mujoco::ModelPointer& model) {
    static std::mutex mutex;
    static std::map<const mjModel*, std::weak_ptr<DataPool>> all;
    const std::lock_guard<std::mutex> lock(mutex);
    for (auto each = all.begin(); each != all.end();) {
      each = each->second.expired() ? all.erase(each) : std::next(each);
    }
    std::weak_ptr<DataPool>& known = all[model.get()];
    std::shared_ptr<DataPool> pool = known.lock();
    if (!pool) known = pool = std::make_shared<DataPool>(model);
    return pool;
  }

  /// Borrows an mjData, with the contents that the last borrower left, until destruction.
  class Loan {
   public:
    explicit Loan(DataPool& pool) : pool_(pool) {
      {
        const std::lock_guard<std::mutex> lock(pool_.mutex_);
        if (!pool_.unused_.empty()) {
          data_ = std::move(pool_.unused_.back());
          pool_.unused_.pop_back();
        }
      }
      if (data_) return;
      data_ = mujoco::make_data(*pool_.model_);
      const std::lock_guard<std::mutex> lock(pool_.mutex_);
      pool_.unused_.reserve(++pool_.num_made_);  // so that the destructor cannot fail
    }
    Loan(const Loan&) = delete;
    Loan& operator=(const Loan&) = delete;
    ~Loan() {
      const std::lock_guard<std::mutex> lock(pool_.mutex_);
      pool_.unused_.push_back(std::move(data_));
    }

    mjData& data() const { return *data_; }

   private:
    DataPool& pool_;
    mujoco::DataPointer data_;
  };

 private:
  mujoco::ModelPointer model_;
  std::mutex mutex_;
  std::size_t num_made_ = 0;
  std::vector<mujoco::DataPointer> unused_;
};

class KernelPhysics : public mujoco::Physics {
 public:
  KernelPhysics(const Kernel& kernel, mujoco::ModelPointer model)
      : kernel_(kernel),
        ground_(ground_of(*model)),
        pool_(DataPool::of(model)),
        model_(std::move(model)) {}

  const mjModel& model() const override { return *model_; }
  const double* position() const override { return world_.position.data(); }
  const double* velocity() const override { return world_.velocity.data(); }

  void reset(const double* position, const double* velocity) override {
    std::copy_n(position, World::kSize, world_.position.begin());
    std::copy_n(velocity, World::kSize, world_.velocity.begin());
    control_ = {};
    kernel_.start(world_, ground_);
    if (!world_.is_flagged) return;
    const DataPool::Loan loan(*pool_);
    mjData& data = loan.data();
    mj_resetData(model_.get(), &data);
    std::copy_n(position, World::kSize, data.qpos);
    std::copy_n(velocity, World::kSize, data.qvel);
    mj_forward(model_.get(), &data);
    read(data);
  }

  void step(const double* control, int count) override {
    const World before = world_;
    World* const world = &world_;
    if (take_control(control)) kernel_.step_singly(&world, 1, count, ground_);
    if (world_.is_flagged) step_by_library(before, count);
  }

  void step_together(mujoco::PhysicsCall* calls, std::size_t num_calls,
                     int count) noexcept override {
    std::array<KernelPhysics*, kMaxGroupSize> members{};
    std::array<World, kMaxGroupSize> before;
    std::array<World*, kMaxGroupSize> worlds{};
    std::size_t num_worlds = 0;
    for (std::size_t i = 0; i < num_calls; ++i) {
      members[i] = find_alike(calls[i]);
      if (members[i] == nullptr) {
        Physics::step_together(&calls[i], 1, count);
        continue;
      }
      before[i] = members[i]->world_;
      if (members[i]->take_control(calls[i].control)) worlds[num_worlds++] = &members[i]->world_;
    }
    // Worlds with the same contacts are solved together fastest.
    std::sort(worlds.begin(), worlds.begin() + num_worlds,
              [](const World* a, const World* b) { return a->pattern < b->pattern; });
    // A single remaining world is faster alone than in a vector.
    const std::size_t num_alone = num_worlds % kernel_.lanes == 1 ? 1 : 0;
    kernel_.step(worlds.data(), num_worlds - num_alone, count, ground_);
    kernel_.step_singly(worlds.data() + num_worlds - num_alone, num_alone, count, ground_);
    for (std::size_t i = 0; i < num_calls; ++i) {
      if (members[i] == nullptr || !members[i]->world_.is_flagged) continue;
      try {
        members[i]->step_by_library(before[i], count);
      } catch (...) {
        calls[i].failure = std::current_exception();
      }
    }
  }

  std::size_t group_size() const override { return kMaxGroupSize; }

  void measure(const std::function<void(const mjData&)>& look) const override {
    const DataPool::Loan loan(*pool_);
    mjData& data = loan.data();
    write(world_, data);
    std::copy(control_.begin(), control_.end(), data.ctrl);
    mj_kinematics(model_.get(), &data);
    mj_collision(model_.get(), &data);
    mj_transmission(model_.get(), &data);
    mj_fwdActuation(model_.get(), &data);
    look(data);
  }

  void save(double* values) const override {
    values = std::copy(world_.position.begin(), world_.position.end(), values);
    values = std::copy(world_.velocity.begin(), world_.velocity.end(), values);
    values = std::copy(world_.warm_start.begin(), world_.warm_start.end(), values);
    values = std::copy(control_.begin(), control_.end(), values);
    values = std::fill_n(values, World::kSize - World::kMotors, 0.0);  // the trunk has no motors
    // The library adds each torque to 0, which turns -0 into 0.
    std::transform(world_.torque.begin(), world_.torque.end(), values,
                   [](double torque) { return 0.0 + torque; });
  }

  void load(const double* values) override {
    world_ = {};
    const double* next = values;
    const auto take = [&next](auto& to) {
      std::copy_n(next, to.size(), to.begin());
      next += to.size();
    };
    take(world_.position);
    take(world_.velocity);
    take(world_.warm_start);
    take(control_);
    next += World::kSize - World::kMotors;
    take(world_.torque);
  }

  std::string stepper() const override {
    return std::string("the kernel for ") + kernel_.instruction_set;
  }

 private:
  /// Returns the call's world if it has the same kernel and model, else null: between the creation
  /// of two environments the user may have changed the model's file or selected another kernel.
  KernelPhysics* find_alike(const mujoco::PhysicsCall& call) const {
    auto* const other = dynamic_cast<KernelPhysics*>(call.physics);
    const bool is_alike =
        other != nullptr && &other->kernel_ == &kernel_ && other->model_ == model_;
    return is_alike ? other : nullptr;
  }

  /// mj_fwdActuation. @return whether the kernel can make the step; if not, the world is flagged
  bool take_control(const double* control) {
    std::copy_n(control, World::kMotors, control_.begin());
    world_.is_flagged = !std::all_of(control_.begin(), control_.end(),
                                     [](double value) { return std::abs(value) <= mjMAXVAL; });
    for (std::size_t motor = 0; motor < World::kMotors; ++motor) {
      const int index = static_cast<int>(motor);
      const double* const range = mujoco::at(model_->actuator_ctrlrange, index, 2);
      world_.torque[motor] = mujoco::at(model_->actuator_gear, index, 6)[0] *
                             std::clamp(control_[motor], range[0], range[1]);
    }
    return !world_.is_flagged;
  }

  /// @throws as `step`
  void step_by_library(const World& before, int count) {
    const DataPool::Loan loan(*pool_);
    mjData& data = loan.data();
    mj_resetData(model_.get(), &data);
    write(before, data);
    mujoco::advance(*model_, data, control_.data(), count);
    read(data);
    mujoco::check_warnings(data);
  }

  static void write(const World& world, mjData& data) {
    std::copy(world.position.begin(), world.position.end(), data.qpos);
    std::copy(world.velocity.begin(), world.velocity.end(), data.qvel);
    std::copy(world.warm_start.begin(), world.warm_start.end(), data.qacc_warmstart);
  }

  void read(const mjData& data) {
    read_state(data, world_);
    std::copy_n(data.ctrl, World::kMotors, control_.begin());
  }

  const Kernel& kernel_;
  Ground ground_;
  std::shared_ptr<DataPool> pool_;
  mujoco::ModelPointer model_;
  World world_;
  std::array<double, World::kMotors> control_{};
};

}  // namespace

std::unique_ptr<mujoco::Physics> make_kernel_physics(mujoco::ModelPointer model) {
  const KernelChoice choice = choose_kernel(*model);
  if (choice.kernel == nullptr) {
    return std::make_unique<mujoco::LibraryPhysics>(std::move(model), choice.fallback_reason);
  }
  return std::make_unique<KernelPhysics>(*choice.kernel, std::move(model));
}

}  // namespace walker::walker2d
