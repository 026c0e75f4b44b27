// MuJoCo's vector and spatial algebra (engine_util_blas.c, engine_util_spatial.c,
// engine_util_sparse.c, engine_util_solve.c) for several instances, in its order of operations;
// smooth.h has the licence.
//
// A spatial motion is (angular, linear velocity), a force (torque, force), and an inertia (Ixx,
// Iyy, Izz, Ixy, Ixz, Iyz, m dx, m dy, m dz, m). All are about one point, from which the body's
// centre of mass is at d:
//
//   a x (w, v)      = (a_w x w, a_w x v + a_v x w)        mju_crossMotion
//   a x* (t, f)     = (a_w x t + a_v x f, a_w x f)        mju_crossForce
//   inertia (w, v)  = (I w + m d x v, m v - m d x w)      mju_mulInertVec
//
// The joint-space inertia M has a row per degree of freedom: the diagonal element, then those of
// its ancestors. The Hessian H = L L' is a lower triangle; an update makes it H + x x' or H - x x'.
#pragma once

#include <cmath>

#include "robots/mujoco/kernel/kernel.h"
#include WALKER_SIM_MODEL_CONSTANTS
#include "simd/vector.h"

namespace walker::mujoco::kernel::WALKER_SIM_ROBOT {
inline namespace WALKER_SIM_INSTRUCTION_SET {

using simd::abs;
using simd::any;
using simd::exceeds;
using simd::is_zero;
using simd::select;
using simd::sqrt;
using simd::to_bits;
using simd::unrolled;
using simd::unrolled_backwards;

template <int W>
using Vector = simd::Vector<double, W>;
template <int W>
using Mask = simd::Mask<double, W>;

constexpr int kLimbs = model::nbody - 1;  ///< bodies that move, each with one capsule
constexpr double kMinimum = 1e-15;        ///< mjMINVAL

constexpr bool is_hinge(int joint) { return model::jnt_type[joint] == 3; }  // mjJNT_HINGE

/// Number of degrees of freedom from this one to the root, both included.
constexpr int depth(int dof) {
  int count = 0;
  for (; dof >= 0; dof = model::dof_parentid[dof]) ++count;
  return count;
}

constexpr int ancestor(int dof, int steps) {
  for (; steps > 0; --steps) dof = model::dof_parentid[dof];
  return dof;
}

template <int W>
inline void sine_and_cosine(Vector<W> angle, Vector<W>& sine, Vector<W>& cosine) {
  alignas(8 * W) double sines[W];
  alignas(8 * W) double cosines[W];
  for (int lane = 0; lane < W; ++lane) {
    sine_and_cosine_of(angle[lane], &sines[lane], &cosines[lane]);
  }
  for (int lane = 0; lane < W; ++lane) {
    sine.set(lane, sines[lane]);
    cosine.set(lane, cosines[lane]);
  }
}

/// mju_rotVecMat.
template <typename V>
WALKER_SIM_INLINE inline void rotate_by_matrix(V* result, const double* v, const V* m) {
  result[0] = m[0] * V(v[0]) + m[1] * V(v[1]) + m[2] * V(v[2]);
  result[1] = m[3] * V(v[0]) + m[4] * V(v[1]) + m[5] * V(v[2]);
  result[2] = m[6] * V(v[0]) + m[7] * V(v[1]) + m[8] * V(v[2]);
}

/// mju_rotVecQuat.
template <typename V>
WALKER_SIM_INLINE inline void rotate_by_quaternion(V* result, const double* v, const V* q) {
  const V t0 = q[0] * V(v[0]) + q[2] * V(v[2]) - q[3] * V(v[1]);
  const V t1 = q[0] * V(v[1]) + q[3] * V(v[0]) - q[1] * V(v[2]);
  const V t2 = q[0] * V(v[2]) + q[1] * V(v[1]) - q[2] * V(v[0]);
  result[0] = V(v[0]) + V(2.0) * (q[2] * t2 - q[3] * t1);
  result[1] = V(v[1]) + V(2.0) * (q[3] * t0 - q[1] * t2);
  result[2] = V(v[2]) + V(2.0) * (q[1] * t1 - q[2] * t0);
}

/// mju_mulQuat; the result may alias a factor.
/// @tparam B V, or double for a constant
template <typename V, typename B>
WALKER_SIM_INLINE inline void multiply_quaternions(V* result, const V* a, const B* b) {
  const V t0 = a[0] * V(b[0]) - a[1] * V(b[1]) - a[2] * V(b[2]) - a[3] * V(b[3]);
  const V t1 = a[0] * V(b[1]) + a[1] * V(b[0]) + a[2] * V(b[3]) - a[3] * V(b[2]);
  const V t2 = a[0] * V(b[2]) - a[1] * V(b[3]) + a[2] * V(b[0]) + a[3] * V(b[1]);
  const V t3 = a[0] * V(b[3]) + a[1] * V(b[2]) - a[2] * V(b[1]) + a[3] * V(b[0]);
  result[0] = t0;
  result[1] = t1;
  result[2] = t2;
  result[3] = t3;
}

/// mju_quat2Mat.
template <typename V>
WALKER_SIM_INLINE inline void to_matrix(V* m, const V* q) {
  const V q00 = q[0] * q[0];
  const V q01 = q[0] * q[1];
  const V q02 = q[0] * q[2];
  const V q03 = q[0] * q[3];
  const V q11 = q[1] * q[1];
  const V q12 = q[1] * q[2];
  const V q13 = q[1] * q[3];
  const V q22 = q[2] * q[2];
  const V q23 = q[2] * q[3];
  const V q33 = q[3] * q[3];
  m[0] = q00 + q11 - q22 - q33;
  m[4] = q00 - q11 + q22 - q33;
  m[8] = q00 - q11 - q22 + q33;
  m[1] = V(2.0) * (q12 - q03);
  m[2] = V(2.0) * (q13 + q02);
  m[3] = V(2.0) * (q12 + q03);
  m[5] = V(2.0) * (q23 - q01);
  m[6] = V(2.0) * (q13 - q02);
  m[7] = V(2.0) * (q23 + q01);
}

/// mju_crossMotion.
template <typename V>
WALKER_SIM_INLINE inline void cross_motion(V* result, const V* a, const V* v) {
  result[0] = -a[2] * v[1] + a[1] * v[2];
  result[1] = a[2] * v[0] - a[0] * v[2];
  result[2] = -a[1] * v[0] + a[0] * v[1];
  result[3] = -a[2] * v[4] + a[1] * v[5];
  result[4] = a[2] * v[3] - a[0] * v[5];
  result[5] = -a[1] * v[3] + a[0] * v[4];
  result[3] += -a[5] * v[1] + a[4] * v[2];
  result[4] += a[5] * v[0] - a[3] * v[2];
  result[5] += -a[4] * v[0] + a[3] * v[1];
}

/// mju_crossForce.
template <typename V>
WALKER_SIM_INLINE inline void cross_force(V* result, const V* a, const V* f) {
  result[0] = -a[2] * f[1] + a[1] * f[2];
  result[1] = a[2] * f[0] - a[0] * f[2];
  result[2] = -a[1] * f[0] + a[0] * f[1];
  result[3] = -a[2] * f[4] + a[1] * f[5];
  result[4] = a[2] * f[3] - a[0] * f[5];
  result[5] = -a[1] * f[3] + a[0] * f[4];
  result[0] += -a[5] * f[4] + a[4] * f[5];
  result[1] += a[5] * f[3] - a[3] * f[5];
  result[2] += -a[4] * f[3] + a[3] * f[4];
}

/// mju_inertCom: a body's inertia about another point.
template <typename V>
WALKER_SIM_INLINE inline void inertia_about(V* result, const V* inertia, const V* matrix,
                                            const V* offset, V mass) {
  const V* const m = matrix;
  const V* const d = offset;
  const V t[9] = {m[0] * inertia[0], m[3] * inertia[0], m[6] * inertia[0],
                  m[1] * inertia[1], m[4] * inertia[1], m[7] * inertia[1],
                  m[2] * inertia[2], m[5] * inertia[2], m[8] * inertia[2]};
  result[0] = m[0] * t[0] + m[1] * t[3] + m[2] * t[6];
  result[1] = m[3] * t[1] + m[4] * t[4] + m[5] * t[7];
  result[2] = m[6] * t[2] + m[7] * t[5] + m[8] * t[8];
  result[3] = m[0] * t[1] + m[1] * t[4] + m[2] * t[7];
  result[4] = m[0] * t[2] + m[1] * t[5] + m[2] * t[8];
  result[5] = m[3] * t[2] + m[4] * t[5] + m[5] * t[8];
  result[0] += mass * (d[1] * d[1] + d[2] * d[2]);
  result[1] += mass * (d[0] * d[0] + d[2] * d[2]);
  result[2] += mass * (d[0] * d[0] + d[1] * d[1]);
  result[3] -= mass * d[0] * d[1];
  result[4] -= mass * d[0] * d[2];
  result[5] -= mass * d[1] * d[2];
  result[6] = mass * d[0];
  result[7] = mass * d[1];
  result[8] = mass * d[2];
  result[9] = mass;
}

/// mju_mulInertVec.
template <typename V>
WALKER_SIM_INLINE inline void multiply_inertia(V* result, const V* i, const V* v) {
  result[0] = i[0] * v[0] + i[3] * v[1] + i[4] * v[2] - i[8] * v[4] + i[7] * v[5];
  result[1] = i[3] * v[0] + i[1] * v[1] + i[5] * v[2] + i[8] * v[3] - i[6] * v[5];
  result[2] = i[4] * v[0] + i[5] * v[1] + i[2] * v[2] - i[7] * v[3] + i[6] * v[4];
  result[3] = i[8] * v[1] - i[7] * v[2] + i[9] * v[3];
  result[4] = i[6] * v[2] - i[8] * v[0] + i[9] * v[4];
  result[5] = i[7] * v[0] - i[6] * v[1] + i[9] * v[5];
}

/// mju_dot: four partial sums, added in MuJoCo's order, then the remaining products.
template <int N, typename V>
WALKER_SIM_INLINE inline V dot(const V* a, const V* b) {
  static_assert(N >= 1 && N < 12);
  if constexpr (N < 4) {
    V sum = a[0] * b[0];
    unrolled<N - 1>([&](auto i) WALKER_SIM_INLINE { sum += a[i + 1] * b[i + 1]; });
    return sum;
  } else {
    constexpr int kBlocks = N / 4 * 4;
    V part[4];
    unrolled<4>([&](auto i) WALKER_SIM_INLINE {
      part[i] = a[i] * b[i];
      if constexpr (kBlocks == 8) part[i] += a[4 + i] * b[4 + i];
    });
    const V sum = (part[0] + part[2]) + (part[1] + part[3]);
    if constexpr (N == kBlocks) {
      return sum;
    } else {
      return sum + dot<N - kBlocks>(a + kBlocks, b + kBlocks);
    }
  }
}

/// mj_mulM: the joint-space inertia times a vector.
template <typename V>
WALKER_SIM_INLINE inline void multiply_by_inertia(V* result, const V* M, const V* x) {
  using namespace model;
  unrolled<nv>([&](auto i) WALKER_SIM_INLINE { result[i] = 0.0; });
  unrolled<nv>([&](auto i) WALKER_SIM_INLINE {
    result[i] += M[dof_Madr[i]] * x[i];
    unrolled<depth(i) - 1>([&](auto k) WALKER_SIM_INLINE {
      constexpr int j = ancestor(i, k + 1);
      constexpr int at = dof_Madr[i] + k + 1;
      result[i] += M[at] * x[j];
      result[j] += M[at] * x[i];
    });
  });
}

/// mj_solveLD: multiplies x by the inverse of the joint-space inertia.
template <typename V>
WALKER_SIM_INLINE inline void solve_factored(V* x, const V* LD, const V* inverse_diagonal) {
  using namespace model;
  unrolled_backwards<nv>([&](auto i) WALKER_SIM_INLINE {
    const V value = x[i];
    unrolled<depth(i) - 1>([&](auto k) WALKER_SIM_INLINE {
      x[ancestor(i, k + 1)] -= LD[dof_Madr[i] + k + 1] * value;
    });
  });
  unrolled<nv>([&](auto i) WALKER_SIM_INLINE { x[i] *= inverse_diagonal[i]; });
  unrolled<nv>([&](auto i) WALKER_SIM_INLINE {
    V value = x[i];
    unrolled<depth(i) - 1>([&](auto k) WALKER_SIM_INLINE {
      value -= LD[dof_Madr[i] + k + 1] * x[ancestor(i, k + 1)];
    });
    x[i] = value;
  });
}

// ---------------------------------------------------------------- Cholesky factor of the Hessian

/// Index into the lower triangle, stored row by row.
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
}  // namespace walker::mujoco::kernel::WALKER_SIM_ROBOT
