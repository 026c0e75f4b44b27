// The choice of a kernel.
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <vector>

#include "base/bits.h"
#include "base/random.h"
#include "robots/mujoco/kernel/kernel_physics.h"
#include "robots/mujoco/planar_model.h"

namespace walker::mujoco::kernel {
namespace {

// -fno-builtin-sin and -fno-builtin-cos prevent the compiler from merging the calls into a sincos.
void call_sin_and_cos(double angle, double* sine, double* cosine) {
  *sine = std::sin(angle);
  *cosine = std::cos(angle);
}

bool is_sincos_the_same() {
  constexpr int kAngles = 50000;
  Generator generator(0);
  for (int i = 0; i < kAngles; ++i) {
    const double largest = std::pow(10.0, generator.uniform(-8, 8));
    const double angle = generator.uniform(-largest, largest);
    double sine = 0;
    double cosine = 0;
    ::sincos(angle, &sine, &cosine);
    if (to_bits(sine) != to_bits(std::sin(angle)) || to_bits(cosine) != to_bits(std::cos(angle))) {
      return false;
    }
  }
  return true;
}

/// Steps the same instances with the kernel and with the library.
class KernelCheck {
 public:
  KernelCheck(const Kernel& kernel, const mjModel& model)
      : kernel_(kernel), model_(model), values_(values_of(model)) {
    for (int i = 0; i < kInstances; ++i) begin(static_cast<double>(i) / kInstances);
  }

  void step() {
    std::vector<Instance> together;
    together.reserve(data_.size());
    for (const DataPointer& each : data_) {
      std::generate_n(each->ctrl, model_.nu, [this] { return generator_.uniform(-1, 1); });
      Instance& instance = together.emplace_back();
      instance.values = &values_;
      read_state(model_, *each, instance);
      for (int i = 0; i < model_.nu; ++i) {
        instance.torque[i] = at(model_.actuator_gear, i, 6)[0] * each->ctrl[i];
      }
    }
    std::vector<Instance> singly = together;
    std::vector<Instance*> instances(together.size());
    std::transform(together.begin(), together.end(), instances.begin(),
                   [](Instance& w) { return &w; });
    kernel_.step(instances.data(), instances.size(), 1);
    for (std::size_t i = 0; i < data_.size(); ++i) {
      Instance* const instance = &singly[i];
      kernel_.step_singly(&instance, 1, 1);
      mj_step(&model_, data_[i].get());
      compare(together[i], *data_[i]);
      compare(*instance, *data_[i]);
    }
  }

  /// Whether no result differed and few were flagged.
  bool has_passed() const { return num_different_ == 0 && num_equal_ > 10 * num_flagged_; }

 private:
  static constexpr int kInstances = 19;  // leaves the last group of lanes incomplete

  /// Adds an instance. With the wildness the state goes from standing to extreme, also below the
  /// floor.
  void begin(double wildness) {
    Instance instance;
    instance.values = &values_;
    data_.push_back(make_data(model_));
    mjData& data = *data_.back();
    for (int i = 0; i < model_.nq; ++i) {
      data.qpos[i] = wildness * generator_.uniform(-2, 2);
      data.qvel[i] = 10 * wildness * generator_.uniform(-1, 1);
    }
    data.qpos[1] = 1.25 + wildness * generator_.uniform(-1.25, 0);
    read_state(model_, data, instance);
    mj_forward(&model_, &data);
    kernel_.start(instance);
    compare(instance, data);
  }

  void compare(const Instance& instance, const mjData& data) {
    int& count = has_state(model_, instance, data) ? num_equal_ : num_different_;
    ++(instance.is_flagged ? num_flagged_ : count);
  }

  const Kernel& kernel_;
  const mjModel& model_;
  ModelValues<double> values_;
  Generator generator_{0};
  std::vector<DataPointer> data_;
  int num_equal_ = 0;
  int num_different_ = 0;
  int num_flagged_ = 0;
};

}  // namespace

ModelValues<double> values_of(const mjModel& model) {
  ModelValues<double> values{};
  values.gravity = model.opt.gravity[2];
  values.damping = model.dof_damping[kBaseJoints];
  values.mean_inertia = model.stat.meaninertia;
  std::copy_n(&model.dof_invweight0[kBaseJoints], model.nu, values.limit_weight);
  std::array<double, kMaxLimbs + 1> subtree_mass{};
  for (int body = model.nbody - 1; body > 0; --body) {
    // mj_comPos sums the masses from the last body to the first.
    const int limb = body - 1;
    subtree_mass[body] += model.body_mass[body];
    subtree_mass[model.body_parentid[body]] += subtree_mass[body];
    values.mass[limb] = model.body_mass[body];
    values.inverse_subtree_mass[limb] = 1 / subtree_mass[body];
    std::copy_n(at(model.body_inertia, body, 3), 3, values.inertia[limb]);
    const double friction = std::max(mjMINMU, at(model.pair_friction, limb, 5)[0]);
    // mj_makeConstraint adds the weights of both bodies, in their order.
    const double weight =
        at(model.body_invweight0, 0, 2)[0] + at(model.body_invweight0, body, 2)[0];
    values.friction[limb] = friction;
    values.diagonal[limb] = weight + friction * friction * weight;
  }
  return values;
}

void (*sine_and_cosine_of)(double, double*, double*) = call_sin_and_cos;

void choose_sine_and_cosine() {
  [[maybe_unused]] static const bool kIsChosen = [] {
    if (is_sincos_the_same()) sine_and_cosine_of = ::sincos;
    return true;
  }();
}

void read_state(const mjModel& model, const mjData& data, Instance& instance) {
  std::copy_n(data.qpos, model.nq, instance.position.begin());
  std::copy_n(data.qvel, model.nv, instance.velocity.begin());
  std::copy_n(data.qacc_warmstart, model.nv, instance.warm_start.begin());
}

bool has_state(const mjModel& model, const Instance& instance, const mjData& data) {
  const auto is_equal = [](const mjtNum* numbers, const Instance::Coordinates& coordinates,
                           int count) {
    return std::equal(numbers, numbers + count, coordinates.begin(),
                      [](double a, double b) { return to_bits(a) == to_bits(b); });
  };
  return is_equal(data.qpos, instance.position, model.nq) &&
         is_equal(data.qvel, instance.velocity, model.nv) &&
         is_equal(data.qacc_warmstart, instance.warm_start, model.nv);
}

bool is_as_library(const Kernel& kernel, const mjModel& model) {
  constexpr int kSteps = 12;
  KernelCheck check(kernel, model);
  for (int i = 0; i < kSteps; ++i) check.step();
  return check.has_passed();
}

KernelChoice choose_kernel(const Kernels& kernels, const mjModel& model) {
  const simd::AllowedKernels<Kernel> allowed = simd::allowed_kernels(kernels.usable);
  const std::string other_field = kernels.unsupported_reason(model);
  if (!other_field.empty()) return {nullptr, "the model has another " + other_field};
  return simd::choose_kernel(allowed, [&model](const Kernel& kernel) {
    choose_sine_and_cosine();
    return is_as_library(kernel, model);
  });
}

}  // namespace walker::mujoco::kernel
