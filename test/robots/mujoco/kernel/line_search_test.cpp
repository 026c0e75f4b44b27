// The line search stops after as many evaluations as MuJoCo's. Walks do not reach this limit.
#define WALKER_SIM_ROBOT walker2d
#define WALKER_SIM_MODEL_CONSTANTS "robots/walker2d/model_constants.h"
#define WALKER_SIM_INSTRUCTION_SET tested
#include "robots/mujoco/kernel/line_search.h"

#include <gtest/gtest.h>

#include <cmath>

namespace walker::mujoco::kernel::walker2d {
namespace {

constexpr double kTolerance = 1e-9;
constexpr int kBefore = 2;  // evaluations by the caller: the start and the first step

TEST(LineSearch, StopsOnAnEndlessDescent) {
  int evaluations = kBefore;
  const auto evaluate = [&](Point<double>& point) {
    ++evaluations;
    point = {point.alpha, -point.alpha, -1, 1};
  };
  const double alpha = LineSearch(evaluate, kTolerance).run({0, 0, -1, 1}, {1, -1, -1, 1});
  EXPECT_EQ(evaluations, 50);
  EXPECT_EQ(alpha, 1 + 50 - kBefore);
}

/// The slope jumps from -1 to 1 at the minimum, so that no point is flat.
TEST(LineSearch, StopsOnABracketThatOnlyNarrows) {
  constexpr double kMinimum = 0.3;
  int evaluations = kBefore;
  const auto value_at = [](double alpha) -> Point<double> {
    const double way = alpha - kMinimum;
    return {alpha, std::abs(way) + way * way / 2, way + std::copysign(1, way), 1};
  };
  const auto evaluate = [&](Point<double>& point) {
    ++evaluations;
    point = value_at(point.alpha);
  };
  const double alpha = LineSearch(evaluate, kTolerance).run(value_at(-1), value_at(0));
  EXPECT_EQ(evaluations, 50);
  EXPECT_NEAR(alpha, kMinimum, 1e-6);
}

/// The slope is steeper the nearer the minimum is, so no candidate narrows the bracket and the
/// search returns the first midpoint.
TEST(LineSearch, ReturnsTheMidpointIfNothingNarrowsTheBracket) {
  const auto value_at = [](double alpha) -> Point<double> {
    return {alpha, 2 * std::abs(alpha) - alpha * alpha / 2,
            std::copysign(2 - std::abs(alpha), alpha), 0.5};
  };
  for (const double side : {-1, 1}) {
    int evaluations = kBefore;
    const auto evaluate = [&](Point<double>& point) {
      ++evaluations;
      point = value_at(point.alpha);
    };
    EXPECT_EQ(LineSearch(evaluate, kTolerance).run(value_at(1.5 * side), value_at(side)), 0);
    EXPECT_EQ(evaluations, kBefore + 3);
  }
}

/// Two halves of parabolas: the Newton step from either side leads to the minimum.
TEST(LineSearch, FindsTheMinimumBetweenTwoParabolas) {
  const auto evaluate = [](Point<double>& point) {
    const double way = point.alpha - 0.3;
    const double steepness = way < 0 ? 1 : 8;
    point = {point.alpha, steepness * way * way / 2, steepness * way, steepness};
  };
  Point<double> start{0, 0, 0, 0};
  evaluate(start);
  Point<double> first{0.5, 0, 0, 0};
  evaluate(first);
  EXPECT_NEAR(LineSearch(evaluate, kTolerance).run(start, first), 0.3, kTolerance);
}

}  // namespace
}  // namespace walker::mujoco::kernel::walker2d
