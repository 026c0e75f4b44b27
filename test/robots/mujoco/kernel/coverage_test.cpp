// What the kernels' bits depend on: the model, of which any change that affects them is rejected,
// and the C library's sine and cosine.
#include "robots/mujoco/kernel/kernel_physics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "bits.h"
#include "robots/mujoco/kernel/model_fields.h"
#include "robots/mujoco/kernel/run.h"
#include "robots/mujoco/model.h"
#include "robots/mujoco/model_file.h"
#include "temporary_folder.h"

namespace walker::mujoco::kernel {
namespace {

struct DeleteModel {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
};

std::unique_ptr<mjModel, DeleteModel> copy(const std::string& xml_file) {
  return std::unique_ptr<mjModel, DeleteModel>(mj_copyModel(nullptr, load_model(xml_file).get()));
}

template <typename T>
void change(T& value) {
  if constexpr (std::is_floating_point_v<T>) {
    value = std::nextafter(value, 1e9);
  } else {
    value = static_cast<T>(value + 1);
  }
}

class CoverageTest : public testing::TestWithParam<std::string> {
 protected:
  /// By the kernels of the parameter's robot.
  std::string unsupported_reason(const mjModel& model) const {
    return robot_of(GetParam()).kernels.unsupported_reason(model);
  }
};

INSTANTIATE_TEST_SUITE_P(Robots, CoverageTest, testing::Values("hopper", "walker2d"));

TEST_P(CoverageTest, CoversTheBuiltInModels) {
  EXPECT_EQ(unsupported_reason(*load_model(GetParam() + "_v4.xml")), "");
  EXPECT_EQ(unsupported_reason(*load_model(GetParam() + "_v5.xml")), "");
}

TEST_P(CoverageTest, RejectsAnotherRobot) {
  const bool is_hopper = GetParam() == "hopper";
  EXPECT_EQ(unsupported_reason(*load_model(is_hopper ? "walker2d_v5.xml" : "hopper_v5.xml")), "nq");
}

/// Changes each number of each field by one unit in the last place, and each integer by one.
TEST_P(CoverageTest, NamesEveryChangedField) {
  const auto model = copy(GetParam() + "_v5.xml");
  int num_changes = 0;
  const auto expect_named = [&](auto& value, const std::string& field) {
    const auto before = value;
    change(value);
    EXPECT_EQ(unsupported_reason(*model), field);
    value = before;
    ++num_changes;
  };
#define CHANGE_COUNT(name) expect_named(model->name, #name);
  WALKER_SIM_MODEL_COUNTS(CHANGE_COUNT)
#define CHANGE_NUMBER(type, part, name) expect_named(model->part.name, #part "." #name);
  WALKER_SIM_MODEL_NUMBERS(CHANGE_NUMBER)
  expect_named(model->opt.gravity[2], "opt.gravity");
  expect_named(model->opt.wind[0], "opt.wind");
#define CHANGE_ARRAY(type, name, rows, columns) \
  for (int i = 0; i < model->rows * (columns); ++i) expect_named(model->name[i], #name);
  WALKER_SIM_MODEL_ARRAYS(CHANGE_ARRAY)
  EXPECT_GT(num_changes, 75 * model->nbody);
  EXPECT_EQ(unsupported_reason(*model), "");
}

/// With smaller buffers MuJoCo fails where the kernel would continue; the kernel check allocates
/// the data of many instances.
TEST_P(CoverageTest, LimitsBufferSizes) {
  const auto model = copy(GetParam() + "_v5.xml");
  for (int* const size : {&model->nconmax, &model->njmax, &model->nstack}) {
    const int built_in = *size;
    for (const auto& [value, is_covered] : {std::pair(built_in - 1, false),
                                            {built_in + 1, true},
                                            {100 * built_in, true},
                                            {100 * built_in + 1, false}}) {
      *size = value;
      EXPECT_EQ(unsupported_reason(*model).empty(), is_covered) << value;
    }
    *size = built_in;
  }
}

/// Each limb may have any friction, but the same along both tangents, which share one row. That of
/// limbs with each other has no effect.
TEST_P(CoverageTest, AllowsAnyFrictionEqualAlongBothTangents) {
  const auto model = copy(GetParam() + "_v5.xml");
  constexpr std::size_t kLimb = 3;
  mjtNum* const friction = &model->pair_friction[5 * kLimb];
  friction[0] = friction[1] = 0.3;
  EXPECT_EQ(unsupported_reason(*model), "");
  EXPECT_EQ(values_of(*model).friction[kLimb], 0.3);
  friction[1] = 0.4;
  EXPECT_EQ(unsupported_reason(*model), "pair_friction");
  friction[1] = friction[0];
  for (int pair = model->nbody - 1; pair < model->npair; ++pair) {
    model->pair_friction[std::ptrdiff_t{5} * pair] = 7;
  }
  EXPECT_EQ(unsupported_reason(*model), "");
}

/// Gymnasium's files generate contacts from masks instead of pairs.
TEST_P(CoverageTest, RejectsGymnasiumsFiles) {
  const Folder folder;
  const std::string file = folder.write("robot.xml", stock_text(GetParam() + "_v5.xml"));
  EXPECT_NE(unsupported_reason(*load_model(file)), "");
}

void expect_as_sin_and_cos(double angle) {
  double sine = 0;
  double cosine = 0;
  sine_and_cosine_of(angle, &sine, &cosine);
  ASSERT_EQ(to_bits(sine), to_bits(std::sin(angle))) << std::hexfloat << angle;
  ASSERT_EQ(to_bits(cosine), to_bits(std::cos(angle))) << std::hexfloat << angle;
}

void expect_all_as_sin_and_cos() {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> power(-320, 308);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int i = 0; i < 300000; ++i) {
    expect_as_sin_and_cos(std::pow(10.0, power(random)) * unit(random));
    expect_as_sin_and_cos(3 * unit(random));
    if (testing::Test::HasFatalFailure()) return;
  }
  for (const double angle : {0.0, -0.0, 5e-324, std::numeric_limits<double>::max()}) {
    expect_as_sin_and_cos(angle);
  }
}

/// Tests the default, then sincos if the C library's sincos has the same bits.
TEST(TrigonometryTest, HasTheBitsOfSinAndCos) {
  expect_all_as_sin_and_cos();
  choose_sine_and_cosine();
  expect_all_as_sin_and_cos();
}

}  // namespace
}  // namespace walker::mujoco::kernel
