// The C library's sines and cosines: MuJoCo calls it, and its bits are what is asked for.
#pragma once

namespace walker::walker2d {

/// Both of an angle [rad], as sin and cos give them.
extern void (*sine_and_cosine_of)(double angle, double* sine, double* cosine);

/// Takes sincos for it, which is faster, where that has the bits of sin and cos: in glibc 2.31 it
/// has not, in 2.36 it has. Tried once in a process, on 50,000 angles.
void choose_sine_and_cosine();

}  // namespace walker::walker2d
