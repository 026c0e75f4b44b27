// The choice of a kernel.
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <vector>

#include "base/bits.h"
#include "base/random.h"
#include "robots/mujoco/planar_model.h"
#include "robots/walker2d/kernel/kernel_physics.h"
#include "robots/walker2d/kernel/model_fields.h"
#include "robots/walker2d/model_constants.h"

namespace walker::walker2d {
namespace {

constexpr int kMaxBuffer = 100;  // upper bound, in sizes of the built-in model's buffer

/// Compares to the bit. The model stores some integers as bytes.
bool is_equal(double a, double b) { return to_bits(a) == to_bits(b); }
bool is_equal(int a, int b) { return a == b; }

template <typename T, typename Source>
bool are_equal(const Source* values, const T* constants, std::size_t size) {
  return std::equal(constants, constants + size, values, [](T constant, Source value) {
    return is_equal(static_cast<T>(value), constant);
  });
}

/// The kernel assumes the same parameters for all limits and pairs, and for both tangents.
std::string why_not_uniform(const mjModel& model) {
  const mjtNum* const solref = mujoco::at(model.jnt_solref, 3, mjNREF);
  const mjtNum* const solimp = mujoco::at(model.jnt_solimp, 3, mjNIMP);
  for (int joint = 3; joint < model.njnt; ++joint) {
    if (!are_equal(mujoco::at(model.jnt_solref, joint, mjNREF), solref, mjNREF))
      return "jnt_solref";
    if (!are_equal(mujoco::at(model.jnt_solimp, joint, mjNIMP), solimp, mjNIMP))
      return "jnt_solimp";
  }
  for (int pair = 0; pair < model.npair; ++pair) {
    if (!are_equal(mujoco::at(model.pair_solref, pair, mjNREF), solref, mjNREF))
      return "pair_solref";
    if (!are_equal(mujoco::at(model.pair_solimp, pair, mjNIMP), solimp, mjNIMP))
      return "pair_solimp";
    const mjtNum* const friction = mujoco::at(model.pair_friction, pair, 5);
    if (!is_equal(friction[0], friction[1])) return "pair_friction";
  }
  return "";
}

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

/// Steps the same worlds with the kernel and with the library.
class KernelCheck {
 public:
  KernelCheck(const Kernel& kernel, const mjModel& model)
      : kernel_(kernel), model_(model), values_(values_of(model)) {
    for (int i = 0; i < kWorlds; ++i) begin(static_cast<double>(i) / kWorlds);
  }

  void step() {
    std::vector<World> together;
    together.reserve(data_.size());
    for (const mujoco::DataPointer& each : data_) {
      std::generate_n(each->ctrl, World::kMotors, [this] { return generator_.uniform(-1, 1); });
      World& world = together.emplace_back();
      world.values = &values_;
      read_state(*each, world);
      for (int i = 0; i < model_.nu; ++i) {
        world.torque[i] = mujoco::at(model_.actuator_gear, i, 6)[0] * each->ctrl[i];
      }
    }
    std::vector<World> singly = together;
    std::vector<World*> worlds(together.size());
    std::transform(together.begin(), together.end(), worlds.begin(), [](World& w) { return &w; });
    kernel_.step(worlds.data(), worlds.size(), 1);
    for (std::size_t i = 0; i < data_.size(); ++i) {
      World* const world = &singly[i];
      kernel_.step_singly(&world, 1, 1);
      mj_step(&model_, data_[i].get());
      compare(together[i], *data_[i]);
      compare(*world, *data_[i]);
    }
  }

  /// Whether no result differed and few were flagged.
  bool has_passed() const { return num_different_ == 0 && num_equal_ > 10 * num_flagged_; }

 private:
  static constexpr int kWorlds = 19;  // leaves the last group of lanes incomplete

  /// Adds a world. With the wildness the state goes from standing to extreme, also below the floor.
  void begin(double wildness) {
    World world;
    world.values = &values_;
    for (std::size_t i = 0; i < World::kSize; ++i) {
      world.position[i] = wildness * generator_.uniform(-2, 2);
      world.velocity[i] = 10 * wildness * generator_.uniform(-1, 1);
    }
    world.position[1] = 1.25 + wildness * generator_.uniform(-1.25, 0);
    data_.push_back(mujoco::make_data(model_));
    mjData& data = *data_.back();
    std::copy(world.position.begin(), world.position.end(), data.qpos);
    std::copy(world.velocity.begin(), world.velocity.end(), data.qvel);
    mj_forward(&model_, &data);
    kernel_.start(world);
    compare(world, data);
  }

  void compare(const World& world, const mjData& data) {
    int& count = has_state(world, data) ? num_equal_ : num_different_;
    ++(world.is_flagged ? num_flagged_ : count);
  }

  const Kernel& kernel_;
  const mjModel& model_;
  ModelValues<double> values_;
  Generator generator_{0};
  std::vector<mujoco::DataPointer> data_;
  int num_equal_ = 0;
  int num_different_ = 0;
  int num_flagged_ = 0;
};

}  // namespace

std::string unsupported_reason(const mjModel& model) {
#define COMPARE_COUNT(name) \
  if (model.name != model::name) return #name;
  WALKER_SIM_MODEL_COUNTS(COMPARE_COUNT)
// The upper bound limits the trial's memory: it allocates an mjData for each of its worlds.
#define COMPARE_BUFFER(name) \
  if (model.name < model::name || model.name > kMaxBuffer * model::name) return #name;
  WALKER_SIM_MODEL_BUFFERS(COMPARE_BUFFER)
#define COMPARE_NUMBER(type, part, name) \
  if (!is_equal(model.part.name, model::part##_##name)) return #part "." #name;
  WALKER_SIM_MODEL_NUMBERS(COMPARE_NUMBER)
  if (!are_equal(model.opt.gravity, model::opt_gravity, 3)) return "opt.gravity";
  if (!are_equal(model.opt.wind, model::opt_wind, 3)) return "opt.wind";
#define COMPARE_ARRAY(type, name, rows, columns)                          \
  if (!are_equal(model.name, reinterpret_cast<const type*>(&model::name), \
                 sizeof model::name / sizeof(type))) {                    \
    return #name;                                                         \
  }
  WALKER_SIM_MODEL_ARRAYS(COMPARE_ARRAY)
  return why_not_uniform(model);
}

ModelValues<double> values_of(const mjModel& model) {
  ModelValues<double> values{};
  values.gravity = model.opt.gravity[2];
  values.damping = model.dof_damping[mujoco::kBaseJoints];
  values.mean_inertia = model.stat.meaninertia;
  std::copy_n(&model.dof_invweight0[mujoco::kBaseJoints], World::kMotors, values.limit_weight);
  std::array<double, ModelValues<double>::kLimbs + 1> subtree_mass{};
  for (int body = model.nbody - 1; body > 0; --body) {
    // mj_comPos sums the masses from the last body to the first.
    const int limb = body - 1;
    subtree_mass[body] += model.body_mass[body];
    subtree_mass[model.body_parentid[body]] += subtree_mass[body];
    values.mass[limb] = model.body_mass[body];
    values.inverse_subtree_mass[limb] = 1 / subtree_mass[body];
    std::copy_n(mujoco::at(model.body_inertia, body, 3), 3, values.inertia[limb]);
    const double friction = std::max(mjMINMU, mujoco::at(model.pair_friction, limb, 5)[0]);
    // mj_makeConstraint adds the weights of both bodies, in their order.
    const double weight =
        mujoco::at(model.body_invweight0, 0, 2)[0] + mujoco::at(model.body_invweight0, body, 2)[0];
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

void read_state(const mjData& data, World& world) {
  std::copy_n(data.qpos, World::kSize, world.position.begin());
  std::copy_n(data.qvel, World::kSize, world.velocity.begin());
  std::copy_n(data.qacc_warmstart, World::kSize, world.warm_start.begin());
}

bool has_state(const World& world, const mjData& data) {
  return are_equal(data.qpos, world.position.data(), World::kSize) &&
         are_equal(data.qvel, world.velocity.data(), World::kSize) &&
         are_equal(data.qacc_warmstart, world.warm_start.data(), World::kSize);
}

bool is_as_library(const Kernel& kernel, const mjModel& model) {
  constexpr int kSteps = 12;
  KernelCheck check(kernel, model);
  for (int i = 0; i < kSteps; ++i) check.step();
  return check.has_passed();
}

KernelChoice choose_kernel(const mjModel& model) {
  const simd::AllowedKernels<Kernel> allowed = simd::allowed_kernels(kernels());
  const std::string other_field = unsupported_reason(model);
  if (!other_field.empty()) return {nullptr, "the model has another " + other_field};
  return simd::choose_kernel(allowed, [&model](const Kernel& kernel) {
    choose_sine_and_cosine();
    return is_as_library(kernel, model);
  });
}

}  // namespace walker::walker2d
