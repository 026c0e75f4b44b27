// The exact line search of MuJoCo's solvers after its first Newton step, for one instance
// (engine_solver.c of MuJoCo 2.2.2; see smooth.h).
//
// Along the search direction the cost is a convex, piecewise quadratic function of the step alpha:
// the sum of the polynomials q of the term without rows and of those rows that are active at alpha,
//
//   cost = q0 + q1 alpha + q2 alpha^2,   slope = q1 + 2 q2 alpha,   slope_change = 2 q2
//
// A Newton step is alpha -= slope / slope_change. The search makes Newton steps in one direction
// until the slope changes its sign, then narrows the interval between the last two points with both
// ends' Newton steps and the midpoint. It ends where |slope| < tolerance, which `Solver` sets to
// opt.tolerance * 0.01 * |search| * meaninertia * nv, or after 50 evaluations.
#pragma once

#include "robots/mujoco/kernel/algebra.h"

namespace walker::mujoco::kernel::WALKER_SIM_ROBOT {
inline namespace WALKER_SIM_INSTRUCTION_SET {

constexpr int kMaxEvaluations = 50;  ///< mjMAXLSITER of 2.2.2

/// Cost and its first two derivatives at the step length alpha along the search direction.
template <typename V>
struct Point {
  V alpha, cost, slope, slope_change;
};

/// Computes a point from the sum of the rows' polynomials.
template <typename V>
WALKER_SIM_INLINE inline void conclude(const V* sum, Point<V>& point) {
  point.cost = point.alpha * point.alpha * sum[2] + point.alpha * sum[1] + sum[0];
  point.slope = V(2.0) * point.alpha * sum[2] + sum[1];
  point.slope_change = V(2.0) * sum[2];
}

template <int W>
inline Point<double> in_lane(const Point<Vector<W>>& point, int lane) {
  return {point.alpha[lane], point.cost[lane], point.slope[lane], point.slope_change[lane]};
}

/// CGsearch after its first step.
template <typename Evaluate>
class LineSearch {
 public:
  /// @param evaluate computes the other members of a point from its alpha
  LineSearch(const Evaluate& evaluate, double tolerance)
      : evaluate_(evaluate), tolerance_(tolerance) {}

  /// @param start point at alpha 0
  /// @param p1    point after the first Newton step, or `start` if its cost is lower
  /// @return alpha
  double run(const Point<double>& start, Point<double> p1) {
    const double direction = p1.slope < 0 ? 1 : -1;
    Point<double> p2{};
    bool has_p2 = false;
    while (p1.slope * direction <= -tolerance_ && count_ < kMaxEvaluations) {
      p2 = p1;
      has_p2 = true;
      p1.alpha -= p1.slope / p1.slope_change;
      complete(p1);
      if (is_flat(p1)) return p1.alpha;
    }
    if (count_ >= kMaxEvaluations || !has_p2) return p1.alpha;

    // The minimum lies between p1 and p2. Candidates: the next Newton points of both, the midpoint.
    Point<double> candidates[3];
    Point<double>& p1_next = candidates[0];
    Point<double>& p2_next = candidates[1];
    Point<double>& middle = candidates[2];
    p2_next = p1;
    p1_next = newton_point(p1);
    while (count_ < kMaxEvaluations) {
      middle.alpha = 0.5 * (p1.alpha + p2.alpha);
      complete(middle);
      const Point<double>* best = nullptr;
      for (const Point<double>& candidate : candidates) {
        if (is_flat(candidate) && (best == nullptr || candidate.cost < best->cost)) {
          best = &candidate;
        }
      }
      if (best != nullptr) return best->alpha;
      const Point<double> as_they_were[3] = {candidates[0], candidates[1], candidates[2]};
      const bool moved_p1 = tighten(as_they_were, p1, p1_next);
      const bool moved_p2 = tighten(as_they_were, p2, p2_next);
      if (!moved_p1 && !moved_p2) return middle.alpha;
    }
    if (p1.cost <= p2.cost && p1.cost < start.cost) return p1.alpha;
    if (p2.cost <= p1.cost && p2.cost < start.cost) return p2.alpha;
    return 0;
  }

 private:
  void complete(Point<double>& point) {
    evaluate_(point);
    ++count_;
  }

  Point<double> newton_point(const Point<double>& point) {
    Point<double> next{};
    next.alpha = point.alpha - point.slope / point.slope_change;
    complete(next);
    return next;
  }

  bool is_flat(const Point<double>& point) const {
    return __builtin_fabs(point.slope) < tolerance_;
  }

  /// updateBracket: moves to the candidates on this side of the minimum that are nearer to it.
  bool tighten(const Point<double>* candidates, Point<double>& bracket, Point<double>& next) {
    bool has_moved = false;
    for (int i = 0; i < 3; ++i) {
      const double slope = candidates[i].slope;
      if ((slope < 0 && bracket.slope < slope) || (slope > 0 && bracket.slope > slope)) {
        bracket = candidates[i];
        has_moved = true;
      }
    }
    if (has_moved) next = newton_point(bracket);
    return has_moved;
  }

  const Evaluate& evaluate_;
  double tolerance_;
  int count_ = 2;  // evaluations of the start and the first step
};

}  // namespace WALKER_SIM_INSTRUCTION_SET
}  // namespace walker::mujoco::kernel::WALKER_SIM_ROBOT
