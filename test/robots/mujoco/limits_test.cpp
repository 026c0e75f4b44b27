// The built-in models' contact pairs and buffer sizes affect the cost of a step, not its result.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

#include "base/random.h"
#include "robots/mujoco/model.h"
#include "robots/mujoco/model_file.h"
#include "robots/mujoco/physics.h"
#include "robots/mujoco/player.h"

namespace walker::mujoco {
namespace {

constexpr double kPi = 3.141592653589793;

using State = std::vector<double>;
using Control = std::vector<double>;

struct Case {
  const char* file;
  int num_pairs;
  int max_contacts;      // two per pair of capsules, or of a capsule and the floor
  int max_constraints;   // four per frictional contact, one per frictionless one or joint limit
  State worst_position;  // all capsules entirely in the ground, all joints beyond their limits
  int worst_contacts;    // in that position
  int worst_constraints;
};

std::vector<Case> cases() {
  const State walker2d{0, -2, kPi / 2, 0.6, 0.6, 1.0, 0.7, 0.5, -1.0};
  const State hopper{0, -2, kPi / 2, 0.6, 0.6, 1.0};
  return {{"walker2d_v4.xml", 7, 14, 62, walker2d, 14, 62},
          {"walker2d_v5.xml", 7, 14, 62, walker2d, 14, 62},
          {"hopper_v4.xml", 7, 14, 41, hopper, 8, 35},
          {"hopper_v5.xml", 7, 14, 41, hopper, 8, 35}};
}

struct Usage {
  int contacts = 0;
  int constraints = 0;
  int stack = 0;  // number of mjtNum

  void add(const mjData& data) {
    contacts = std::max(contacts, data.maxuse_con);
    constraints = std::max(constraints, data.maxuse_efc);
    stack = std::max(stack, data.maxuse_stack);
    for (const int warning : {mjWARN_CONTACTFULL, mjWARN_CNSTRFULL, mjWARN_VGEOMFULL}) {
      ASSERT_EQ(data.warning[warning].number, 0) << mju_warningText(warning, 0);
    }
  }
};

/// Draws states and controls that do not occur in normal episodes.
class ExtremeStates {
 public:
  explicit ExtremeStates(std::uint64_t seed) : generator_(seed) {}

  /// Draws a base between deep in the ground and high in the air, joints beyond their limits, and
  /// speeds up to `fastest`.
  void draw(double fastest, State& position, State& velocity) {
    for (std::size_t i = 0; i < position.size(); ++i) {
      position[i] = generator_.uniform(-kPi, kPi);
      velocity[i] = generator_.uniform(-fastest, fastest);
    }
    position[kBaseZ] = generator_.uniform(-2, 2);
  }

  void draw(Control& control) {
    for (double& value : control) value = static_cast<double>(generator_.integers(-1, 2));
  }

  double draw_speed() {
    constexpr std::array<double, 4> kSpeeds{0, 1, 20, 300};
    return kSpeeds[static_cast<std::size_t>(generator_.integers(0, kSpeeds.size()))];
  }

 private:
  Generator generator_;
};

class Limits : public testing::TestWithParam<Case> {
 protected:
  ModelPointer ours = load_model(GetParam().file);
  State position = State(ours->nq);
  State velocity = State(ours->nv);
  Control control = Control(ours->nu);
};

TEST_P(Limits, FitTheSizesAndAreReachedByTheWorstCase) {
  EXPECT_LE(GetParam().max_contacts, ours->nconmax);
  EXPECT_LE(GetParam().max_constraints, ours->njmax);
  LibraryPhysics physics(ours);
  Usage usage;
  for (const double depth : {-2.0, -5.0, -20.0}) {
    for (const double speed : {0.0, 30.0, -30.0}) {
      position = GetParam().worst_position;
      position[kBaseZ] = depth;
      std::fill(velocity.begin(), velocity.end(), speed);
      physics.reset(position.data(), velocity.data());
      for (std::size_t i = 0; i < control.size(); ++i) control[i] = i % 2 == 0 ? 1 : -1;
      usage.add(physics.data());
      EXPECT_EQ(physics.data().ncon, GetParam().worst_contacts);
      EXPECT_EQ(physics.data().nefc, GetParam().worst_constraints);
      physics.step(control.data(), {}, kFrameSkip);
      usage.add(physics.data());
    }
  }
  EXPECT_EQ(usage.contacts, GetParam().worst_contacts);
  EXPECT_EQ(usage.constraints, GetParam().worst_constraints);
  EXPECT_LT(usage.stack, ours->nstack / 4);
}

TEST_P(Limits, AreNotExceededByExtremeStates) {
  LibraryPhysics physics(ours);
  ExtremeStates states(1);
  Usage usage;
  int unstable = 0;
  for (int i = 0; i < 10000; ++i) {
    states.draw(states.draw_speed(), position, velocity);
    states.draw(control);
    physics.reset(position.data(), velocity.data());
    usage.add(physics.data());
    try {
      physics.step(control.data(), {}, 1);
    } catch (const std::runtime_error&) {
      ++unstable;
    }
    usage.add(physics.data());
  }
  EXPECT_GE(usage.contacts, GetParam().worst_contacts);
  EXPECT_LE(usage.contacts, GetParam().max_contacts);
  EXPECT_GE(usage.constraints, GetParam().worst_constraints);
  EXPECT_LE(usage.constraints, GetParam().max_constraints);
  EXPECT_LT(usage.stack, ours->nstack / 4);
  EXPECT_LT(unstable, 100);
}

/// Compares the state, accelerations and warm start after every engine step with those of the same
/// model without pairs and sizes.
class Equality : public Limits {
 protected:
  /// @return the error message if the engine fails, otherwise an empty string
  static std::string step_once(LibraryPhysics& physics, const Control& control) {
    try {
      physics.step(control.data(), {}, 1);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }

  void expect_equal() {
    const mjData& data = pair_[0].data();
    const mjData& expected = pair_[1].data();
    ASSERT_EQ(data.ncon, expected.ncon);
    ASSERT_EQ(data.nefc, expected.nefc);
    for (int i = 0; i < ours->nv; ++i) {
      ASSERT_EQ(data.qpos[i], expected.qpos[i]) << i;
      ASSERT_EQ(data.qvel[i], expected.qvel[i]) << i;
      ASSERT_EQ(data.qacc[i], expected.qacc[i]) << i;
      ASSERT_EQ(data.qacc_warmstart[i], expected.qacc_warmstart[i]) << i;
    }
    max_contacts_ = std::max(max_contacts_, data.ncon);
  }

  Folder folder_;
  ModelPointer stock_ = load_model(folder_.write("stock.xml", stock_text(GetParam().file)));
  std::array<LibraryPhysics, 2> pair_{LibraryPhysics(ours), LibraryPhysics(stock_)};
  int max_contacts_ = 0;
};

TEST_P(Equality, IsTestedAgainstAnotherModel) {
  EXPECT_EQ(ours->npair, GetParam().num_pairs);
  EXPECT_EQ(ours->opt.collision, mjCOL_PAIR);
  EXPECT_EQ(stock_->npair, 0);
  EXPECT_EQ(stock_->opt.collision, mjCOL_ALL);
  EXPECT_GT(stock_->nconmax, ours->nconmax);
  EXPECT_GT(stock_->njmax, ours->njmax);
}

TEST_P(Equality, HoldsInExtremeStates) {
  constexpr int kStepsFromEach = 20;
  constexpr int kWantedSteps = 50000;
  ExtremeStates states(2);
  int steps = 0;
  while (steps < kWantedSteps) {
    states.draw(states.draw_speed(), position, velocity);
    for (LibraryPhysics& physics : pair_) physics.reset(position.data(), velocity.data());
    expect_equal();
    for (int i = 0; i < kStepsFromEach; ++i) {
      if (i % kFrameSkip == 0) states.draw(control);
      const std::string error = step_once(pair_[0], control);
      ASSERT_EQ(error, step_once(pair_[1], control));
      if (!error.empty()) break;
      ++steps;
      expect_equal();
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_GE(max_contacts_, GetParam().worst_contacts);
}

std::string name_of(const testing::TestParamInfo<Case>& test) {
  const std::string file = test.param.file;
  return file.substr(0, file.find('.'));
}

INSTANTIATE_TEST_SUITE_P(BuiltIn, Limits, testing::ValuesIn(cases()), name_of);
INSTANTIATE_TEST_SUITE_P(BuiltIn, Equality, testing::ValuesIn(cases()), name_of);

}  // namespace
}  // namespace walker::mujoco
