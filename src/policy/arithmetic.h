// What a network computes, in an order of its own: the sums and the tanh of Eigen are others in
// its other versions, and so would be the actions. These have the bits of Eigen 3.4 without fused
// multiply-add.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>

/// These become part of functions that are compiled for one set of instructions.
#define WALKER_SIM_INLINE __attribute__((always_inline))

namespace walker {

/// `lanes` numbers that are computed together.
template <int lanes>
struct Lanes {           // not by `using`, where GCC loses the attribute
  typedef float Numbers  // NOLINT(modernize-use-using)
      __attribute__((vector_size(lanes * sizeof(float))));
};
template <>
struct Lanes<1> {
  using Numbers = float;
};

/// `add_product` for `vectors * lanes` rows, whose first number in `weight` and in `outputs` these
/// are. Sums are in registers: `batch * vectors` of them.
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

/// output += weight * input, for each of `batch` inputs and outputs, which follow each other in
/// memory. weight: rows x columns, column by column; input: columns; output: rows. What is added up
/// at a time are 16 columns, or all where they are fewer than 128. Neither `lanes` nor `batch`
/// changes a bit.
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

/// A quotient of polynomials, within 4e-7 of tanh; the coefficients are Eigen 3.4's.
WALKER_SIM_INLINE inline float rational_tanh(float value) {
  constexpr float kMax = 7.90531110763549805F;  // beyond, the quotient leaves [-1, 1]
  constexpr float kTiny = 0.0004F;              // below, tanh is its argument
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

/// Each of `count` values.
WALKER_SIM_INLINE inline void replace_by_tanh(float* values, std::ptrdiff_t count) {
  for (std::ptrdiff_t i = 0; i < count; ++i) values[i] = rational_tanh(values[i]);
}

}  // namespace walker

#undef WALKER_SIM_INLINE
