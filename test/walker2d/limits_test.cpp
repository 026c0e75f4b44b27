// The built-in models' contact pairs and buffer sizes change the cost of a step, not its result.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

#include "core/random.h"
#include "stepper.h"
#include "walker2d/model.h"
#include "walker2d/model_file.h"
#include "walker2d/physics.h"
#include "walker2d/player.h"

namespace walker::walker2d {
namespace {

constexpr double kPi = 3.141592653589793;
constexpr int kMostContacts = 14;     // two for each of seven capsules
constexpr int kMostConstraints = 62;  // four for each contact, one for each of six joint limits

using State = std::array<double, kDegreesOfFreedom>;
using Control = std::array<double, kJointCount>;

/// The most that any state so far needed of MuJoCo's buffers.
struct Usage {
  int contacts = 0;
  int constraints = 0;
  int stack = 0;  // [numbers]

  void add(const mjData& data) {
    contacts = std::max(contacts, data.maxuse_con);
    constraints = std::max(constraints, data.maxuse_efc);
    stack = std::max(stack, data.maxuse_stack);
    for (const int warning : {mjWARN_CONTACTFULL, mjWARN_CNSTRFULL, mjWARN_VGEOMFULL}) {
      ASSERT_EQ(data.warning[warning].number, 0) << mju_warningText(warning, 0);
    }
  }
};

/// Draws states that a walk never sees.
class Violence {
 public:
  explicit Violence(std::uint64_t seed) : generator_(seed) {}

  /// Anywhere, from high in the air to deep in the ground, with joints turned beyond their limits
  /// and speeds up to `fastest`.
  void draw(double fastest, State& position, State& velocity) {
    for (int i = 0; i < kDegreesOfFreedom; ++i) {
      position[i] = generator_.uniform(-kPi, kPi);
      velocity[i] = generator_.uniform(-fastest, fastest);
    }
    position[kRootZ] = generator_.uniform(-2, 2);
  }

  /// Each motor full forward, full back or off.
  void draw(Control& control) {
    for (double& value : control) value = static_cast<double>(generator_.integers(-1, 2));
  }

  /// Quiet, brisk or violent [m/s, rad/s].
  double draw_speed() {
    constexpr std::array<double, 4> kSpeeds{0, 1, 20, 300};
    return kSpeeds[static_cast<std::size_t>(generator_.integers(0, kSpeeds.size()))];
  }

 private:
  Generator generator_;
};

class Limits : public testing::TestWithParam<const char*> {
 protected:
  ModelPointer ours = load_model(GetParam());
};

TEST_P(Limits, FitTheSizes) {
  EXPECT_LE(kMostContacts, ours->nconmax);
  EXPECT_LE(kMostConstraints, ours->njmax);
}

/// All capsules in the ground from end to end, all joints beyond their limits, all at once.
TEST_P(Limits, AreReachedByTheWorstCase) {
  Physics physics(ours);
  Usage usage;
  for (const double depth : {-2.0, -5.0, -20.0}) {
    for (const double speed : {0.0, 30.0, -30.0}) {
      const State position{0, depth, kPi / 2, 0.6, 0.6, 1.0, 0.7, 0.5, -1.0};
      State velocity{};
      velocity.fill(speed);
      physics.reset(position.data(), velocity.data());
      const Control control{1, -1, 1, -1, 1, -1};
      usage.add(physics.data());
      EXPECT_EQ(physics.data().ncon, kMostContacts);
      EXPECT_EQ(physics.data().nefc, kMostConstraints);
      physics.step(control.data(), kFrameSkip);
      usage.add(physics.data());
    }
  }
  EXPECT_EQ(usage.contacts, kMostContacts);
  EXPECT_EQ(usage.constraints, kMostConstraints);
  EXPECT_LT(usage.stack, ours->nstack / 4);
}

TEST_P(Limits, AreNotPassedByRandomViolence) {
  Physics physics(ours);
  Violence violence(1);
  Usage usage;
  State position{};
  State velocity{};
  Control control{};
  int unstable = 0;
  for (int i = 0; i < 10000; ++i) {
    violence.draw(violence.draw_speed(), position, velocity);
    violence.draw(control);
    physics.reset(position.data(), velocity.data());
    usage.add(physics.data());
    try {
      physics.step(control.data(), 1);
    } catch (const std::runtime_error&) {
      ++unstable;
    }
    usage.add(physics.data());
  }
  EXPECT_EQ(usage.contacts, kMostContacts);
  EXPECT_EQ(usage.constraints, kMostConstraints);
  EXPECT_LT(usage.stack, ours->nstack / 4);
  EXPECT_LT(unstable, 100);
}

/// Against the same model without pairs and sizes: state, accelerations and warm start of the
/// solver, after every engine step.
class Equality : public Limits {
 protected:
  /// @returns the engine's words when it gives up
  static std::string advance(Physics& physics, const Control& control) {
    try {
      physics.step(control.data(), 1);
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
    for (int i = 0; i < kDegreesOfFreedom; ++i) {
      ASSERT_EQ(data.qpos[i], expected.qpos[i]) << i;
      ASSERT_EQ(data.qvel[i], expected.qvel[i]) << i;
      ASSERT_EQ(data.qacc[i], expected.qacc[i]) << i;
      ASSERT_EQ(data.qacc_warmstart[i], expected.qacc_warmstart[i]) << i;
    }
    most_contacts_ = std::max(most_contacts_, data.ncon);
  }

  Folder folder_;
  ModelPointer stock_ = load_model(folder_.write("stock.xml", stock_text(GetParam())));
  std::array<Physics, 2> pair_{Physics(ours), Physics(stock_)};
  int most_contacts_ = 0;
};

TEST_P(Equality, IsTestedAgainstAnotherModel) {
  EXPECT_EQ(ours->npair, 7);
  EXPECT_EQ(ours->opt.collision, mjCOL_PAIR);
  EXPECT_EQ(stock_->npair, 0);
  EXPECT_EQ(stock_->opt.collision, mjCOL_ALL);
  EXPECT_GT(stock_->nconmax, ours->nconmax);
  EXPECT_GT(stock_->njmax, ours->njmax);
}

TEST_P(Equality, HoldsInRandomAndViolentStates) {
  constexpr int kStepsFromEach = 20;
  constexpr int kWantedSteps = 50000;
  Violence violence(2);
  State position{};
  State velocity{};
  Control control{};
  int steps = 0;
  while (steps < kWantedSteps) {
    violence.draw(violence.draw_speed(), position, velocity);
    for (Physics& physics : pair_) physics.reset(position.data(), velocity.data());
    expect_equal();
    for (int i = 0; i < kStepsFromEach; ++i) {
      if (i % kFrameSkip == 0) violence.draw(control);
      const std::string error = advance(pair_[0], control);
      ASSERT_EQ(error, advance(pair_[1], control));
      if (!error.empty()) break;
      ++steps;
      expect_equal();
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_EQ(most_contacts_, kMostContacts);
}

INSTANTIATE_TEST_SUITE_P(Walker2d, Limits, testing::Values("walker2d_v4.xml", "walker2d_v5.xml"),
                         [](const auto& test) {
                           return std::string(test.param).substr(sizeof("walker2d_") - 1, 2);
                         });
INSTANTIATE_TEST_SUITE_P(Walker2d, Equality, testing::Values("walker2d_v4.xml", "walker2d_v5.xml"),
                         [](const auto& test) {
                           return std::string(test.param).substr(sizeof("walker2d_") - 1, 2);
                         });

/// As a learner sees it.
TEST(StockModel, GivesTheSameEpisodes) {
  const Folder folder;
  const std::string file = folder.write("stock.xml", stock_text("walker2d_v5.xml"));
  Stepper ours("Walker2d-v5", {{"terminate_when_unhealthy", false}});
  Stepper stock("Walker2d-v5", {{"terminate_when_unhealthy", false}, {"xml_file", file}});
  std::vector<double> action;
  for (const char* kind : {"saturated", "random"}) {
    Actions actions(kind, 5);
    ours.reset(7);
    stock.reset(7);
    ASSERT_EQ(ours.observation, stock.observation);
    while (!ours.has_ended()) {
      actions.draw(ours.observation, action);
      ours.step(action);
      stock.step(action);
      ASSERT_EQ(ours.row(), stock.row());
    }
    EXPECT_TRUE(stock.result.truncated);
  }
}

}  // namespace
}  // namespace walker::walker2d
