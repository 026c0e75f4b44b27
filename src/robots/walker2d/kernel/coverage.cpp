#include "robots/walker2d/kernel/coverage.h"

#include <algorithm>
#include <iterator>

#include "base/bits.h"
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

template <typename T, std::size_t N>
const T* first(const T (&array)[N]) {
  return array;
}
template <typename T, std::size_t N, std::size_t M>
const T* first(const T (&array)[N][M]) {
  return array[0];
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
#define COMPARE_ARRAY(type, name, rows, columns)                                       \
  if (!are_equal(model.name, first(model::name), sizeof model::name / sizeof(type))) { \
    return #name;                                                                      \
  }
  WALKER_SIM_MODEL_ARRAYS(COMPARE_ARRAY)
  return why_not_uniform(model);
}

Ground ground_of(const mjModel& model) {
  Ground ground;
  for (std::size_t limb = 0; limb < Ground::kLimbs; ++limb) {
    const int pair = static_cast<int>(limb);
    const double friction = mujoco::at(model.pair_friction, pair, 5)[0];
    const int body = model.geom_bodyid[model.pair_geom2[pair]];
    // mj_makeConstraint adds the weights of both bodies, in their order.
    const double weight =
        mujoco::at(model.body_invweight0, 0, 2)[0] + mujoco::at(model.body_invweight0, body, 2)[0];
    ground.friction[limb] = friction;
    ground.diagonal[limb] = weight + friction * friction * weight;
  }
  return ground;
}

}  // namespace walker::walker2d
