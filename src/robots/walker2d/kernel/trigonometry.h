// Sine and cosine of the C library, which MuJoCo calls: the kernel needs the same bits.
#pragma once

namespace walker::walker2d {

/// Computes sine and cosine of an angle [rad] with the bits of sin and cos.
extern void (*sine_and_cosine_of)(double angle, double* sine, double* cosine);

/// Selects the faster sincos for `sine_and_cosine_of` if it has the bits of sin and cos on 50,000
/// angles: not in glibc 2.31, but in 2.36. Checks once per process.
void choose_sine_and_cosine();

}  // namespace walker::walker2d
