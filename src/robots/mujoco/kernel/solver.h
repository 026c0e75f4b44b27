// MuJoCo's Newton solver (engine_solver.c of MuJoCo 2.2.2; see smooth.h) for pyramidal cones.
//
// Finds the accelerations a that minimize, over the rows r of constraints.h,
//
//   cost(a) = 1/2 (a - a_smooth)' (M a - qfrc_smooth) + sum_r s_r(J_r a - aref_r)
//   s_r(x)  = 1/2 D_r x^2 if x < 0 (active), else 0
//
//   gradient  g = M a - qfrc_smooth - sum_r J_r' f_r,   f_r = -D_r (J_r a - aref_r) if active
//   Hessian   H = M + sum_active D_r J_r' J_r = L L'
//   iteration a += alpha p,   p = -H^-1 g,   alpha: minimum of cost(a + alpha p)
//
// Starts from the warm start, or from a_smooth if its cost is lower. Rows that change sides update
// L. Ends if alpha = 0, after opt.iterations, or if the cost's decrease or |g|, divided by
// meaninertia * nv, is below opt.tolerance. Inputs: M, a_smooth, qfrc_smooth and the rows. State:
// the warm start, which the result replaces.
//
// Finished lanes take steps of length 0. If the first step of a line search does not suffice, as in
// one of five, the search continues lane by lane.
#pragma once

#include <algorithm>

#include "robots/mujoco/kernel/constraints.h"
#include "robots/mujoco/kernel/line_search.h"

namespace walker::mujoco::kernel::WALKER_SIM_ROBOT {
inline namespace WALKER_SIM_INSTRUCTION_SET {

constexpr int kMaxIterations = model::opt_iterations;
constexpr double kTolerance = model::opt_tolerance;
constexpr double kLineSearchTolerance = 0.01;

// There is one at a time, on the stack, so its padding does not matter.
template <int W>
class Solver {  // NOLINT(clang-analyzer-optin.performance.Padding)
 public:
  using V = Vector<W>;

  Solver(const Smooth<V>& smooth, V mean_inertia, Rows<W>& rows)
      : smooth_(smooth), mean_inertia_(mean_inertia), rows_(rows) {}

  /// mj_fwdConstraint.
  /// @param qacc the warm start, MuJoCo's qacc_warmstart; receives the accelerations
  void solve(V* qacc) {
    start(qacc);
    make_gradient(qacc);
    make_hessian();
    choose_direction();
    going_ = rows_.has_any;
    for (int i = 0; i < kMaxIterations && any(going_) && iterate(qacc); ++i) {
    }
    unrolled<kSize>([&](auto i) WALKER_SIM_INLINE {
      qacc[i] = select(rows_.has_any, qacc[i], smooth_.qacc_smooth[i]);
    });
  }

 private:
  static constexpr int kSize = model::nv;

  /// Multiplicity of a contact's row: the third stands for two equal rows.
  static constexpr int times(int row) { return row == 2 ? 2 : 1; }

  WALKER_SIM_INLINE static V cost_of(V D, V residual) {
    return select(residual < V(0.0), V(0.5) * D * residual * residual, V(0.0));
  }

  /// Starts from the warm start or the smooth accelerations, whichever has the lower cost.
  WALKER_SIM_INLINE void start(V* qacc) {
    const V* const qacc_smooth = smooth_.qacc_smooth;
    V warm_cost = 0.0;
    V smooth_cost = 0.0;
    V of_limits[kLimits];
    V of_slots[kMaxSlots][kRows];
    for (int k = 0; k < rows_.num_limits; ++k) {
      auto& limit = rows_.limits[k];
      limit.residual = limit.jacobian * qacc[limit.dof] - limit.reference;
      of_limits[k] = limit.jacobian * qacc_smooth[limit.dof] - limit.reference;
      warm_cost += cost_of(limit.D, limit.residual);
      smooth_cost += cost_of(limit.D, of_limits[k]);
    }
    V(*of_slot)[kRows] = of_slots;
    rows_.for_each_slot([&](auto side, auto& slot) WALKER_SIM_INLINE {
      unrolled<kRows>([&](auto row) WALKER_SIM_INLINE {
        slot.residual[row] = row_times<side, row>(slot.jacobian, qacc) - slot.reference[row];
        (*of_slot)[row] = row_times<side, row>(slot.jacobian, qacc_smooth) - slot.reference[row];
        unrolled<times(row)>([&](auto /*time*/) WALKER_SIM_INLINE {
          warm_cost += cost_of(slot.D, slot.residual[row]);
          smooth_cost += cost_of(slot.D, (*of_slot)[row]);
        });
      });
      ++of_slot;
    });
    multiply_by_inertia(Ma_, smooth_.M, qacc);
    unrolled<kSize>([&](auto i) WALKER_SIM_INLINE {
      warm_cost += V(0.5) * (Ma_[i] - smooth_.qfrc_smooth[i]) * (qacc[i] - qacc_smooth[i]);
    });
    const Mask<W> is_smooth_better = warm_cost > smooth_cost;
    if (!any(is_smooth_better)) return;
    V M_smooth[kSize];
    multiply_by_inertia(M_smooth, smooth_.M, qacc_smooth);
    unrolled<kSize>([&](auto i) WALKER_SIM_INLINE {
      qacc[i] = select(is_smooth_better, qacc_smooth[i], qacc[i]);
      Ma_[i] = select(is_smooth_better, M_smooth[i], Ma_[i]);
    });
    for (int k = 0; k < rows_.num_limits; ++k) {
      V& residual = rows_.limits[k].residual;
      residual = select(is_smooth_better, of_limits[k], residual);
    }
    for (int k = 0; k < rows_.num_slots; ++k) {
      unrolled<kRows>([&](auto row) WALKER_SIM_INLINE {
        V& residual = rows_.slots[k].residual[row];
        residual = select(is_smooth_better, of_slots[k][row], residual);
      });
    }
  }

  /// CGupdateConstraint, CGupdateGradient: the active rows, the cost and its gradient.
  void make_gradient(const V* qacc) {
    const V zero = 0.0;
    V sum = 0.0;
    V force[kSize];
    unrolled<kSize>([&](auto i) WALKER_SIM_INLINE { force[i] = 0.0; });
    for (int k = 0; k < rows_.num_limits; ++k) {
      auto& limit = rows_.limits[k];
      limit.is_active = limit.residual < zero;
      sum += cost_of(limit.D, limit.residual);
      force[limit.dof] += limit.jacobian * select(limit.is_active, -limit.D * limit.residual, zero);
    }
    rows_.for_each_slot([&](auto side, auto& slot) WALKER_SIM_INLINE {
      unrolled<kRows>([&](auto row) WALKER_SIM_INLINE {
        const V residual = slot.residual[row];
        V jacobian[kSize];
        read_row<side, row>(slot.jacobian, jacobian);
        slot.is_active[row] = residual < zero;
        const V cost = cost_of(slot.D, residual);
        const V push = select(slot.is_active[row], -slot.D * residual, zero);
        unrolled<times(row)>([&](auto /*time*/) WALKER_SIM_INLINE { sum += cost; });
        unrolled<kSize>([&](auto dof) WALKER_SIM_INLINE {
          const V share = jacobian[dof] * push;
          unrolled<times(row)>([&](auto /*time*/) WALKER_SIM_INLINE { force[dof] += share; });
        });
      });
    });
    gauss_ = 0.0;
    unrolled<kSize>([&](auto i) WALKER_SIM_INLINE {
      const V unbalanced = Ma_[i] - smooth_.qfrc_smooth[i];
      gauss_ += V(0.5) * unbalanced * (qacc[i] - smooth_.qacc_smooth[i]);
      gradient_[i] = unbalanced - force[i];
    });
    cost_ = sum + gauss_;
  }

  /// HessianDirect: factors the sum of the inertia and the active rows' terms.
  WALKER_SIM_INLINE void make_hessian() {
    const V zero = 0.0;
    unrolled<kTriangle>([&](auto i) WALKER_SIM_INLINE { hessian_[i] = 0.0; });
    for (int k = 0; k < rows_.num_limits; ++k) {
      const auto& limit = rows_.limits[k];
      const V share = limit.jacobian * (limit.jacobian * limit.D);
      hessian_[at(limit.dof, limit.dof)] += select(limit.is_active, share, zero);
    }
    rows_.for_each_slot([&](auto side, auto& slot) WALKER_SIM_INLINE {
      unrolled<kRows>([&](auto row) WALKER_SIM_INLINE {
        if (!any(slot.is_active[row])) return;
        const V D = select(slot.is_active[row], slot.D, zero);
        V jacobian[kSize];
        read_row<side, row>(slot.jacobian, jacobian);
        unrolled<kSize>([&](auto i) WALKER_SIM_INLINE {
          const V scaled = jacobian[i] * D;
          unrolled<i + 1>([&](auto j) WALKER_SIM_INLINE {
            const V share = jacobian[j] * scaled;
            unrolled<times(row)>([&](auto /*time*/)
                                     WALKER_SIM_INLINE { hessian_[at(i, j)] += share; });
          });
        });
      });
    });
    unrolled<kSize>([&](auto i) WALKER_SIM_INLINE {
      unrolled<depth(i)>([&](auto k) WALKER_SIM_INLINE {
        hessian_[at(i, ancestor(i, k))] += smooth_.M[model::dof_Madr[i] + k];
      });
    });
    factor(hessian_);
  }

  void choose_direction() {
    solve_triangles(search_, hessian_, gradient_);
    unrolled<kSize>([&](auto i) WALKER_SIM_INLINE { search_[i] = search_[i] * V(-1.0); });
  }

  /// One iteration of mj_solNewton. @return whether any lane continues
  bool iterate(V* qacc) {
    const V zero = 0.0;
    V Mv[kSize];
    V alpha = search_length(Mv);
    going_ = going_ & ((alpha < zero) | (zero < alpha));
    if (!any(going_)) return false;
    // A finished lane's direction may be NaN: its value is selected, not incremented by 0 * NaN.
    const auto move = [&](V& value, V along) WALKER_SIM_INLINE {
      value = select(going_, value + along * alpha, value);
    };
    unrolled<kSize>([&](auto i) WALKER_SIM_INLINE {
      move(qacc[i], search_[i]);
      move(Ma_[i], Mv[i]);
    });
    Mask<W> limits_before[kLimits];
    Mask<W> slots_before[kMaxSlots][kRows];
    for (int k = 0; k < rows_.num_limits; ++k) {
      move(rows_.limits[k].residual, rows_.limits[k].direction);
      limits_before[k] = rows_.limits[k].is_active;
    }
    for (int k = 0; k < rows_.num_slots; ++k) {
      unrolled<kRows>([&](auto row) WALKER_SIM_INLINE {
        move(rows_.slots[k].residual[row], rows_.slots[k].direction[row]);
        slots_before[k][row] = rows_.slots[k].is_active[row];
      });
    }
    const V cost_before = cost_;
    make_gradient(qacc);
    const V scale = mean_inertia_ * V(kSize);
    const V improvement = (cost_before - cost_) / scale;
    const V steepness = sqrt(dot<kSize>(gradient_, gradient_)) / scale;
    going_ = going_ & ~((improvement < V(kTolerance)) | (steepness < V(kTolerance)));
    if (!any(going_)) return false;
    update_hessian(limits_before, slots_before);
    choose_direction();
    return true;
  }

  /// HessianIncremental: updates the factor for rows that have become active or inactive. Factors
  /// from scratch where an update fails, as in worlds without friction.
  WALKER_SIM_INLINE void update_hessian(const Mask<W>* limits_before,
                                        const Mask<W> (*slots_before)[kRows]) {
    Mask<W> failed = Mask<W>::none();
    const auto update = [&](const V* jacobian, V D, Mask<W> was, Mask<W> is) WALKER_SIM_INLINE {
      const Mask<W> changes = (was ^ is) & going_;
      if (!any(changes)) return;
      const V root = select(changes, sqrt(D), V(0.0));
      V x[kSize];
      unrolled<kSize>([&](auto i) WALKER_SIM_INLINE { x[i] = jacobian[i] * root; });
      failed = failed | (update_factor(hessian_, x, select(is, V(1.0), V(-1.0))) & going_);
    };
    for (int k = 0; k < rows_.num_limits; ++k) {
      const auto& limit = rows_.limits[k];
      V jacobian[kSize];
      unrolled<kSize>([&](auto i) WALKER_SIM_INLINE { jacobian[i] = 0.0; });
      jacobian[limit.dof] = limit.jacobian;
      update(jacobian, limit.D, limits_before[k], limit.is_active);
    }
    const Mask<W>(*slot_before)[kRows] = slots_before;
    rows_.for_each_slot([&](auto side, auto& slot) WALKER_SIM_INLINE {
      unrolled<kRows>([&](auto row) WALKER_SIM_INLINE {
        const Mask<W> was = (*slot_before)[row];
        if (!any((was ^ slot.is_active[row]) & going_)) return;
        V jacobian[kSize];
        read_row<side, row>(slot.jacobian, jacobian);
        unrolled<times(row)>([&](auto /*time*/) WALKER_SIM_INLINE {
          update(jacobian, slot.D, was, slot.is_active[row]);
        });
      });
      ++slot_before;
    });
    if (any(failed)) factor_from_scratch(failed);
  }

  /// Not inlined, because it is rare and would slow down the other iterations.
  __attribute__((noinline, cold)) void factor_from_scratch(Mask<W> lanes) {
    V updated[kTriangle];
    std::copy_n(hessian_, kTriangle, updated);
    make_hessian();
    unrolled<kTriangle>(
        [&](auto i) WALKER_SIM_INLINE { hessian_[i] = select(lanes, hessian_[i], updated[i]); });
  }

  /// CGsearch. @param Mv receives the inertia times the search direction
  WALKER_SIM_INLINE V search_length(V* Mv) {
    const V zero = 0.0;
    const V norm = sqrt(dot<kSize>(search_, search_));
    going_ = going_ & ~(norm < V(kMinimum));
    const V tolerance = V(kTolerance * kLineSearchTolerance) * norm * mean_inertia_ * V(kSize);
    multiply_by_inertia(Mv, smooth_.M, search_);
    prepare_rows();
    V of_gauss[3];
    of_gauss[0] = gauss_;
    of_gauss[1] = dot<kSize>(search_, Ma_) - dot<kSize>(search_, smooth_.qfrc_smooth);
    of_gauss[2] = V(0.5) * dot<kSize>(search_, Mv);
    const auto evaluate = [&](Point<V>& point) WALKER_SIM_INLINE {
      V sum[3] = {of_gauss[0], of_gauss[1], of_gauss[2]};
      const auto add = [&](const V* quadratic, V residual, V direction) WALKER_SIM_INLINE {
        const Mask<W> is_active = (residual + point.alpha * direction) < zero;
        unrolled<3>([&](auto power) WALKER_SIM_INLINE {
          sum[power] += select(is_active, quadratic[power], zero);
        });
      };
      for (int k = 0; k < rows_.num_limits; ++k) {
        const auto& limit = rows_.limits[k];
        add(limit.quadratic, limit.residual, limit.direction);
      }
      for (int k = 0; k < rows_.num_slots; ++k) {
        const auto& slot = rows_.slots[k];
        unrolled<kRows>([&](auto row) WALKER_SIM_INLINE {
          unrolled<times(row)>([&](auto /*time*/) WALKER_SIM_INLINE {
            add(slot.quadratic[row], slot.residual[row], slot.direction[row]);
          });
        });
      }
      conclude(sum, point);
      point.slope_change = select(point.slope_change > zero, point.slope_change, V(kMinimum));
    };
    Point<V> here;
    Point<V> there;
    here.alpha = 0.0;
    evaluate(here);
    there.alpha = zero - here.slope / here.slope_change;
    evaluate(there);
    const Mask<W> is_worse = here.cost < there.cost;
    there.alpha = select(is_worse, here.alpha, there.alpha);
    there.cost = select(is_worse, here.cost, there.cost);
    there.slope = select(is_worse, here.slope, there.slope);
    there.slope_change = select(is_worse, here.slope_change, there.slope_change);
    V alpha = there.alpha;
    unsigned lanes = to_bits(going_ & ~(abs(there.slope) < tolerance));
    for (; lanes != 0; lanes &= lanes - 1) {
      const int lane = __builtin_ctz(lanes);
      alpha.set(lane,
                LineSearch([&](Point<double>& point) { evaluate_lane(of_gauss, lane, point); },
                           tolerance[lane])
                    .run(in_lane(here, lane), in_lane(there, lane)));
    }
    return select(going_, alpha, zero);
  }

  /// CGprepare: each row's cost along the search, as a polynomial.
  WALKER_SIM_INLINE void prepare_rows() {
    const auto make = [](V* quadratic, V residual, V direction, V D) WALKER_SIM_INLINE {
      const V scaled = D * residual;
      quadratic[0] = residual * scaled * V(0.5);
      quadratic[1] = direction * scaled;
      quadratic[2] = direction * D * direction * V(0.5);
    };
    for (int k = 0; k < rows_.num_limits; ++k) {
      auto& limit = rows_.limits[k];
      limit.direction = limit.jacobian * search_[limit.dof];
      make(limit.quadratic, limit.residual, limit.direction, limit.D);
    }
    rows_.for_each_slot([&](auto side, auto& slot) WALKER_SIM_INLINE {
      unrolled<kRows>([&](auto row) WALKER_SIM_INLINE {
        slot.direction[row] = row_times<side, row>(slot.jacobian, search_);
        make(slot.quadratic[row], slot.residual[row], slot.direction[row], slot.D);
      });
    });
  }

  /// CGeval for one lane.
  void evaluate_lane(const V* of_gauss, int lane, Point<double>& point) const {
    double sum[3] = {of_gauss[0][lane], of_gauss[1][lane], of_gauss[2][lane]};
    const auto add = [&](const V* quadratic, V residual, V direction) {
      if (!(residual[lane] + point.alpha * direction[lane] < 0)) return;
      for (int power = 0; power < 3; ++power) sum[power] += quadratic[power][lane];
    };
    for (int k = 0; k < rows_.num_limits; ++k) {
      const auto& limit = rows_.limits[k];
      add(limit.quadratic, limit.residual, limit.direction);
    }
    for (int k = 0; k < rows_.num_slots; ++k) {
      const auto& slot = rows_.slots[k];
      for (int row = 0; row < kRows; ++row) {
        for (int time = 0; time < times(row); ++time) {
          add(slot.quadratic[row], slot.residual[row], slot.direction[row]);
        }
      }
    }
    conclude(sum, point);
    if (point.slope_change <= 0) point.slope_change = kMinimum;
  }

  const Smooth<V>& smooth_;
  V mean_inertia_;
  Rows<W>& rows_;
  V Ma_[kSize];  ///< the inertia times the accelerations
  V gauss_;      ///< the cost without constraint rows
  V cost_;
  V gradient_[kSize];
  V hessian_[kTriangle];  ///< its Cholesky factor
  V search_[kSize];
  Mask<W> going_;
};

}  // namespace WALKER_SIM_INSTRUCTION_SET
}  // namespace walker::mujoco::kernel::WALKER_SIM_ROBOT
