// Box2D's vector algebra (b2Math.h) on one number per lane, in Box2D's order of operations, with
// its rotations, and copies between instances and lanes.
//
// This file, those beside it that say so, and world_step.cpp and world_toi.h restate formulas
// of Box2D 2.3 in code of our own, for several instances at once. They are altered and not the
// original software. Box2D's notice:
//
// Copyright (c) 2006-2011 Erin Catto http://www.box2d.org
//
// This software is provided 'as-is', without any express or implied warranty. In no event will the
// authors be held liable for any damages arising from the use of this software.
// Permission is granted to anyone to use this software for any purpose, including commercial
// applications, and to alter it and redistribute it freely, subject to the following restrictions:
// 1. The origin of this software must not be misrepresented; you must not claim that you wrote the
//    original software. If you use this software in a product, an acknowledgment in the product
//    documentation would be appreciated but is not required.
// 2. Altered source versions must be plainly marked as such, and must not be misrepresented as
//    being the original software.
// 3. This notice may not be removed or altered from any source distribution.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "robots/bipedal_walker/kernel/kernel.h"
#include "simd/vector.h"

namespace walker::bipedal_walker::kernel {
inline namespace WALKER_SIM_INSTRUCTION_SET {

template <int W>
using Number = simd::Vector<float, W>;
template <int W>
using Truth = simd::Mask<float, W>;

constexpr float kLinearSlop = 0.005F;  ///< b2_linearSlop [m]

using simd::any;
using simd::max;
using simd::min;
using simd::select;

/// b2Vec2.
template <int W>
struct Vec2 {
  WALKER_SIM_INLINE friend Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
  WALKER_SIM_INLINE friend Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
  WALKER_SIM_INLINE friend Vec2 operator-(Vec2 a) { return {-a.x, -a.y}; }
  WALKER_SIM_INLINE friend Vec2 operator*(Number<W> s, Vec2 a) { return {s * a.x, s * a.y}; }

  Number<W> x, y;
};

template <int W>
WALKER_SIM_INLINE inline Vec2<W> select(Truth<W> mask, Vec2<W> a, Vec2<W> b) {
  return {select(mask, a.x, b.x), select(mask, a.y, b.y)};
}

template <int W>
WALKER_SIM_INLINE inline Number<W> dot(Vec2<W> a, Vec2<W> b) {
  return a.x * b.x + a.y * b.y;
}

template <int W>
WALKER_SIM_INLINE inline Number<W> cross(Vec2<W> a, Vec2<W> b) {
  return a.x * b.y - a.y * b.x;
}

/// b2Cross(s, a).
template <int W>
WALKER_SIM_INLINE inline Vec2<W> cross(Number<W> s, Vec2<W> a) {
  return {-s * a.y, s * a.x};
}

/// b2Cross(normal, 1).
template <int W>
WALKER_SIM_INLINE inline Vec2<W> tangent_of(Vec2<W> normal) {
  return {normal.y, -normal.x};
}

/// b2Clamp.
template <int W>
WALKER_SIM_INLINE inline Number<W> clamp(Number<W> a, Number<W> low, Number<W> high) {
  return max(low, min(a, high));
}

/// b2Mul of a b2Rot.
template <int W>
WALKER_SIM_INLINE inline Vec2<W> rotate(const Rotation<Number<W>>& q, Vec2<W> a) {
  return {q.cosine * a.x - q.sine * a.y, q.sine * a.x + q.cosine * a.y};
}

/// b2Transform.
template <int W>
struct Transform {
  Rotation<Number<W>> rotation;
  Vec2<W> position;
};

template <int W>
WALKER_SIM_INLINE inline Vec2<W> transform(const Transform<W>& t, Vec2<W> a) {
  const Rotation<Number<W>>& q = t.rotation;
  return {(q.cosine * a.x - q.sine * a.y) + t.position.x,
          (q.sine * a.x + q.cosine * a.y) + t.position.y};
}

/// b2Mat22, columns ex and ey.
template <int W>
struct Mat22 {
  Vec2<W> ex, ey;
};

/// Returns 1 / a, or a if it is zero, as Box2D does for determinants.
template <int W>
WALKER_SIM_INLINE inline Number<W> inverse_of(Number<W> a) {
  return select(simd::is_zero(a), a, Number<W>(1) / a);
}

/// Velocity of a body's centre of mass [m/s], and angular velocity [rad/s].
template <int W>
struct BodyLanes {
  Vec2<W> velocity;
  Number<W> angular_velocity;
};

template <int W>
WALKER_SIM_INLINE inline BodyLanes<W> select(Truth<W> mask, const BodyLanes<W>& a,
                                             const BodyLanes<W>& b) {
  return {select(mask, a.velocity, b.velocity),
          select(mask, a.angular_velocity, b.angular_velocity)};
}

/// Centre of mass [m] and angle [rad] of a body.
template <int W>
struct PositionLanes {
  Vec2<W> center;
  Number<W> angle;
};

template <int W>
WALKER_SIM_INLINE inline PositionLanes<W> select(Truth<W> mask, const PositionLanes<W>& a,
                                                 const PositionLanes<W>& b) {
  return {select(mask, a.center, b.center), select(mask, a.angle, b.angle)};
}

/// Inverse mass [1/kg] and inertia [1/(kg m^2)] of a body, and its centre of mass in its frame [m].
template <int W>
struct MassLanes {
  Number<W> inverse_mass, inverse_inertia;
  Vec2<W> center;
};

static_assert(sizeof(float) == 4 && sizeof(int) == 4, "lanes are moved in words of 4 bytes");

/// Copies the structs of W instances into lanes. To is From with vectors in place of numbers.
template <int W, typename To, typename From>
WALKER_SIM_INLINE inline void gather(To& to, const From* const* from) {
  static_assert(sizeof(To) == W * sizeof(From));
  std::uint32_t words[sizeof(To) / 4];
  for (int lane = 0; lane < W; ++lane) {
    std::uint32_t instance[sizeof(From) / 4];
    std::memcpy(instance, from[lane], sizeof instance);
    for (std::size_t i = 0; i < sizeof(From) / 4; ++i) words[i * W + lane] = instance[i];
  }
  // cppcheck-suppress uninitvar  // there is at least one lane
  std::memcpy(&to, words, sizeof to);
}

/// Copies the first `count` lanes back to their instances.
template <int W, typename To, typename From>
WALKER_SIM_INLINE inline void scatter(const From& from, To* const* to, int count) {
  static_assert(sizeof(From) == W * sizeof(To));
  std::uint32_t words[sizeof(From) / 4];
  std::memcpy(words, &from, sizeof words);
  for (int lane = 0; lane < count; ++lane) {
    std::uint32_t instance[sizeof(To) / 4];
    for (std::size_t i = 0; i < sizeof(To) / 4; ++i) instance[i] = words[i * W + lane];
    // cppcheck-suppress uninitvar  // there is at least one word
    std::memcpy(to[lane], instance, sizeof instance);
  }
}

// Sine and cosine of a float in each lane, with the C library's bits.
//
// glibc (since 2.28, sysdeps/ieee754/flt-32/s_sincosf.h) evaluates a polynomial in double precision
// and rounds once, with fused operations on newer processors. Below, the polynomial is evaluated
// after a range reduction of our own, without fused operations. The floats are the same for every
// angle up to kMaxAngle: rotation_test.cpp tests them all. If any lane is beyond, all call the
// library, as does a single instance.
//
//   n = round(2 angle / pi),   x = angle - n pi/2
//   S(x) = x + s1 x^3 + x^5 (s2 + s3 x^2),   C(x) = 1 + c1 x^2 + c2 x^4 + x^6 (c3 + c4 x^2)
//   (sin, cos) = (S, C), (C, -S), (-S, -C), (-C, S)   for n mod 4 = 0, 1, 2, 3

constexpr float kMaxAngle = 16;         ///< [rad]; the first angle that differs is 17.279
constexpr float kTinyAngle = 0x1p-12F;  ///< below, the sine is the angle itself, also for -0

template <int W>
struct Polynomials {
  simd::Vector<double, W> sine, cosine;  ///< angle minus quarter_turns
  simd::Vector<double, W> quarter_turns;
};

template <int W>
WALKER_SIM_INLINE inline Polynomials<W> evaluate(simd::Vector<double, W> angle) {
  using Double = simd::Vector<double, W>;
  const Double rounder(0x1.8p52);  // adding it rounds to an integer
  const Double quarter_turns = (angle * Double(0x1.45F306DC9C883p-1) + rounder) - rounder;
  const Double x = angle - quarter_turns * Double(0x1.921FB54442D18p0);
  const Double x2 = x * x;
  const Double x3 = x2 * x;
  const Double x4 = x2 * x2;
  const Double sine =
      x3 * x2 * (x2 * Double(-0x1.994eb3774cf24p-13) + Double(0x1.1107605230bc4p-7)) +
      (x3 * Double(-0x1.555545995a603p-3) + x);
  const Double cosine =
      x4 * x2 * (x2 * Double(0x1.99343027bf8c3p-16) + Double(-0x1.6c087e89a359dp-10)) +
      (x4 * Double(0x1.55553e1068f19p-5) + (x2 * Double(-0x1.ffffffd0c621cp-2) + Double(1.0)));
  return {sine, cosine, quarter_turns};
}

/// @param angle at most kMaxAngle in each lane
template <int W>
WALKER_SIM_INLINE inline Rotation<Number<W>> rotation_by_polynomials(Number<W> angle) {
  using Bits = typename Truth<W>::Truth;
  const auto [low, high] = simd::to_double(angle);
  const auto of_low = evaluate(low);
  const auto of_high = evaluate(high);
  const Number<W> sine = simd::to_float<W>({of_low.sine, of_high.sine});
  const Number<W> cosine = simd::to_float<W>({of_low.cosine, of_high.cosine});
  const Bits n = __builtin_convertvector(
      simd::to_float<W>({of_low.quarter_turns, of_high.quarter_turns}).number, Bits);
  const Truth<W> is_odd{(n & 1) != 0};
  const Bits minus_sine = (n & 2) << 30;  // the sign bit
  const Bits minus_cosine = ((n + 1) & 2) << 30;
  const auto with_sign = [](Number<W> a, Bits sign) WALKER_SIM_INLINE {
    return Number<W>::of(
        reinterpret_cast<typename Number<W>::Number>(reinterpret_cast<Bits>(a.number) ^ sign));
  };
  return {select(simd::abs(angle) < Number<W>(kTinyAngle), angle,
                 with_sign(select(is_odd, cosine, sine), minus_sine)),
          with_sign(select(is_odd, sine, cosine), minus_cosine)};
}

/// b2Rot::Set.
template <int W>
WALKER_SIM_INLINE inline Rotation<Number<W>> rotation_of(Number<W> angle) {
  if constexpr (W > 1) {
    if (!any(simd::exceeds(angle, kMaxAngle))) return rotation_by_polynomials<W>(angle);
  }
  Rotation<Number<W>> rotation;
  for (int lane = 0; lane < W; ++lane) {
    rotation.sine.set(lane, std::sin(angle[lane]));
    rotation.cosine.set(lane, std::cos(angle[lane]));
  }
  return rotation;
}

}  // namespace WALKER_SIM_INSTRUCTION_SET
}  // namespace walker::bipedal_walker::kernel
