#include "robots/walker2d/kernel/trigonometry.h"

#include <cmath>

#include "base/bits.h"
#include "base/random.h"

namespace walker::walker2d {
namespace {

// -fno-builtin-sin and -fno-builtin-cos prevent the compiler from merging the calls into a sincos.
void call_sin_and_cos(double angle, double* sine, double* cosine) {
  *sine = std::sin(angle);
  *cosine = std::cos(angle);
}

bool is_sincos_the_same() {
  constexpr int kAngles = 50000;
  Generator generator(0);
  for (int i = 0; i < kAngles; ++i) {
    const double largest = std::pow(10.0, generator.uniform(-8, 8));
    const double angle = generator.uniform(-largest, largest);
    double sine = 0;
    double cosine = 0;
    ::sincos(angle, &sine, &cosine);
    if (to_bits(sine) != to_bits(std::sin(angle)) || to_bits(cosine) != to_bits(std::cos(angle))) {
      return false;
    }
  }
  return true;
}

}  // namespace

void (*sine_and_cosine_of)(double, double*, double*) = call_sin_and_cos;

void choose_sine_and_cosine() {
  static const bool kIsChosen = [] {
    if (is_sincos_the_same()) sine_and_cosine_of = ::sincos;
    return true;
  }();
  static_cast<void>(kIsChosen);
}

}  // namespace walker::walker2d
