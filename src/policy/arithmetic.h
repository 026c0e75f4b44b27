// Arithmetic of a network in a fixed order. Eigen's sums and its tanh differ between versions, and
// actions would differ with them. These functions have the bits of Eigen 3.4 without fused
// multiply-add.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>

/// Inlines into callers that are compiled for one instruction set.
#define WALKER_SIM_INLINE __attribute__((always_inline))

namespace walker {

/// A SIMD vector of `lanes` numbers.
template <int lanes>
struct Lanes {           // GCC loses the attribute in a `using`
  typedef float Numbers  // NOLINT(modernize-use-using)
      __attribute__((vector_size(lanes * sizeof(float))));
};
template <>
struct Lanes<1> {
  using Numbers = float;
};

/// `add_product` for `vectors * lanes` rows; `weight` and `outputs` point to the first one. The
/// `batch * vectors` sums stay in registers.
template <int lanes, int vectors, int batch>
WALKER_SIM_INLINE inline void add_rows(const float* weight, std::ptrdiff_t rows,
                                       std::ptrdiff_t columns, const float* inputs,
                                       float* outputs) {
  using Numbers = typename Lanes<lanes>::Numbers;
  const std::ptrdiff_t block = columns < 128 ? columns : 16;
  Numbers totals[batch][vectors];
  for (std::ptrdiff_t k = 0; k < batch; ++k) {
    for (std::ptrdiff_t i = 0; i < vectors; ++i) {
      std::memcpy(&totals[k][i], outputs + k * rows + i * lanes, sizeof(Numbers));
    }
  }
  for (std::ptrdiff_t begin = 0; begin < columns; begin += block) {
    const std::ptrdiff_t end = std::min(begin + block, columns);
    Numbers sums[batch][vectors] = {};
    for (std::ptrdiff_t column = begin; column < end; ++column) {
      for (std::ptrdiff_t i = 0; i < vectors; ++i) {
        Numbers factor;
        std::memcpy(&factor, weight + i * lanes, sizeof factor);
        for (std::ptrdiff_t k = 0; k < batch; ++k)
          sums[k][i] += factor * inputs[k * columns + column];
      }
      weight += rows;
    }
    for (std::ptrdiff_t k = 0; k < batch; ++k) {
      for (std::ptrdiff_t i = 0; i < vectors; ++i) totals[k][i] += sums[k][i];
    }
  }
  for (std::ptrdiff_t k = 0; k < batch; ++k) {
    for (std::ptrdiff_t i = 0; i < vectors; ++i) {
      std::memcpy(outputs + k * rows + i * lanes, &totals[k][i], sizeof(Numbers));
    }
  }
}

/// Computes output += weight * input for each of `batch` contiguous inputs and outputs. weight:
/// rows x columns, column-major; input: columns; output: rows. Partial sums cover 16 columns, or
/// all columns if there are fewer than 128. The bits do not depend on `lanes` or `batch`.
template <int lanes, int batch>
WALKER_SIM_INLINE inline void add_product(const float* weight, std::ptrdiff_t rows,
                                          std::ptrdiff_t columns, const float* inputs,
                                          float* outputs) {
  constexpr int kVectors = batch > 1 ? 2 : 4;
  constexpr std::ptrdiff_t kRows = std::ptrdiff_t{kVectors} * lanes;
  std::ptrdiff_t row = 0;
  for (; row + kRows <= rows; row += kRows) {
    add_rows<lanes, kVectors, batch>(weight + row, rows, columns, inputs, outputs + row);
  }
  for (; row + 4 <= rows; row += 4) {
    add_rows<4, 1, batch>(weight + row, rows, columns, inputs, outputs + row);
  }
  for (; row < rows; ++row) {
    add_rows<1, 1, batch>(weight + row, rows, columns, inputs, outputs + row);
  }
}

/// A quotient of polynomials within 4e-7 of tanh, with the coefficients of Eigen 3.4.
WALKER_SIM_INLINE inline float rational_tanh(float value) {
  constexpr float kMax = 7.90531110763549805F;  // beyond, the quotient leaves [-1, 1]
  constexpr float kTiny = 0.0004F;              // below, tanh(x) rounds to x
  const float x = std::max(std::min(value, kMax), -kMax);
  const float square = x * x;
  float odd = square * -2.76076847742355e-16F + 2.00018790482477e-13F;
  odd = square * odd + -8.60467152213735e-11F;
  odd = square * odd + 5.12229709037114e-08F;
  odd = square * odd + 1.48572235717979e-05F;
  odd = square * odd + 6.37261928875436e-04F;
  odd = square * odd + 4.89352455891786e-03F;
  odd *= x;
  float even = square * 1.19825839466702e-06F + 1.18534705686654e-04F;
  even = square * even + 2.26843463243900e-03F;
  even = square * even + 4.89352518554385e-03F;
  const float quotient = odd / even;
  return std::abs(value) < kTiny ? x : quotient;
}

WALKER_SIM_INLINE inline void replace_by_tanh(float* values, std::ptrdiff_t count) {
  for (std::ptrdiff_t i = 0; i < count; ++i) values[i] = rational_tanh(values[i]);
}

}  // namespace walker

#undef WALKER_SIM_INLINE
