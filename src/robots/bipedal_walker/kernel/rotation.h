// Sine and cosine of a float in each lane, with the C library's bits.
//
// glibc (since 2.28, sysdeps/ieee754/flt-32/s_sincosf.h) evaluates a polynomial in double precision
// and rounds once, with fused operations on newer processors. This file evaluates the polynomial
// after its own range reduction, without fused operations. The floats are the same for every angle
// up to kMaxAngle: rotation_test.cpp tests them all. If any lane is beyond, all call the library.
#pragma once

#include <cmath>

#include "robots/bipedal_walker/kernel/lanes.h"

namespace walker::bipedal_walker::kernel {
inline namespace WALKER_SIM_INSTRUCTION_SET {

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

/// b2Rot::Set.
template <int W>
WALKER_SIM_INLINE inline Rotation<Number<W>> rotation_of(Number<W> angle) {
  using Bits = typename Truth<W>::Truth;
  if (any(simd::exceeds(angle, kMaxAngle))) {
    Rotation<Number<W>> rotation;
    for (int lane = 0; lane < W; ++lane) {
      rotation.sine.set(lane, std::sin(angle[lane]));
      rotation.cosine.set(lane, std::cos(angle[lane]));
    }
    return rotation;
  }
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

}  // namespace WALKER_SIM_INSTRUCTION_SET
}  // namespace walker::bipedal_walker::kernel
