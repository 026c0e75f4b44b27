// Cholesky factor of the solver's Hessian, a lower triangle stored row by row (engine_util_solve.c
// of MuJoCo 2.2.2; see smooth.h).
#pragma once

#include "robots/walker2d/kernel/algebra.h"

namespace walker::walker2d::kernel {
inline namespace WALKER_SIM_INSTRUCTION_SET {

/// Index into the lower triangle.
constexpr int at(int row, int column) { return row * (row + 1) / 2 + column; }
constexpr int kTriangle = at(model::nv, 0);

/// mju_cholFactor.
template <typename V>
WALKER_SIM_INLINE inline void factor(V* H) {
  constexpr int n = model::nv;
  unrolled<n>([&](auto j) WALKER_SIM_INLINE {
    V diagonal = H[at(j, j)];
    if constexpr (j > 0) diagonal -= dot<j>(H + at(j, 0), H + at(j, 0));
    H[at(j, j)] = sqrt(select(diagonal < V(kMinimum), V(kMinimum), diagonal));
    const V inverse = V(1.0) / H[at(j, j)];
    unrolled<n - 1 - j>([&](auto k) WALKER_SIM_INLINE {
      constexpr int i = j + 1 + k;
      if constexpr (j > 0) H[at(i, j)] -= dot<j>(H + at(i, 0), H + at(j, 0));
      H[at(i, j)] *= inverse;
    });
  });
}

/// mju_cholSolve.
template <typename V>
WALKER_SIM_INLINE inline void solve_triangles(V* x, const V* H, const V* b) {
  constexpr int n = model::nv;
  unrolled<n>([&](auto i) WALKER_SIM_INLINE {
    x[i] = b[i];
    if constexpr (i > 0) x[i] -= dot<i>(H + at(i, 0), x);
    x[i] /= H[at(i, i)];
  });
  unrolled_backwards<n>([&](auto i) WALKER_SIM_INLINE {
    unrolled<n - 1 - i>([&](auto k)
                            WALKER_SIM_INLINE { x[i] -= H[at(i + 1 + k, i)] * x[i + 1 + k]; });
    x[i] /= H[at(i, i)];
  });
}

/// mju_cholUpdate with a sign per lane. Lanes in which x is 0 do not change, because the square
/// root of L * L is L.
/// @return lanes whose factor is no longer positive
template <int W>
WALKER_SIM_INLINE inline Mask<W> update_factor(Vector<W>* H, Vector<W>* x, Vector<W> sign) {
  using V = Vector<W>;
  constexpr int n = model::nv;
  Mask<W> is_low = Mask<W>::none();
  unrolled<n>([&](auto k) WALKER_SIM_INLINE {
    if (!any((x[k] < V(0.0)) | (V(0.0) < x[k]))) return;  // a limit's row begins with zeros
    V& diagonal = H[at(k, k)];
    const V square = diagonal * diagonal + sign * (x[k] * x[k]);
    is_low = is_low | (square < V(kMinimum));
    const V r = sqrt(square);
    const V c = r / diagonal;
    const V inverse = V(1.0) / c;
    const V s = x[k] / diagonal;
    const V signed_s = sign * s;
    diagonal = r;
    unrolled<n - 1 - k>([&](auto q) WALKER_SIM_INLINE {
      constexpr int i = k + 1 + q;
      H[at(i, k)] = (H[at(i, k)] + signed_s * x[i]) * inverse;
      x[i] = c * x[i] - s * H[at(i, k)];
    });
  });
  return is_low;
}

}  // namespace WALKER_SIM_INSTRUCTION_SET
}  // namespace walker::walker2d::kernel
