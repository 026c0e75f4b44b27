// What a network computes, in an order of its own: the sums and the tanh of Eigen are others in
// its other versions, and so would be the actions. These have the bits of Eigen 3.4 without fused
// multiply-add.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Core>

namespace walker {

/// Adds to `rows` values of output what `columns` columns give; `weight` is the first one's first
/// of these rows, `stride` the way to the next column.
template <int rows>
void add_columns(const float* weight, Eigen::Index stride, const float* input, Eigen::Index columns,
                 float* output) {
  std::array<float, rows> sums{};
  for (Eigen::Index column = 0; column < columns; ++column) {
    const float factor = input[column];
    for (std::size_t i = 0; i < rows; ++i) sums[i] += weight[i] * factor;
    weight += stride;
  }
  for (std::size_t i = 0; i < rows; ++i) output[i] += sums[i];
}

/// output += weight * input. weight: rows x columns; input: columns; output: rows. What is added up
/// at a time are 16 columns, or all where they are fewer than 128.
inline void add_product(const Eigen::MatrixXf& weight, const Eigen::VectorXf& input,
                        Eigen::VectorXf& output) {
  constexpr int kTogether = 32;
  const Eigen::Index columns = weight.cols();
  const Eigen::Index block = columns < 128 ? columns : 16;
  const Eigen::Index rows = weight.rows();
  for (Eigen::Index begin = 0; begin < columns; begin += block) {
    const Eigen::Index count = std::min(block, columns - begin);
    const float* const factors = weight.data() + begin * rows;
    const float* const values = input.data() + begin;
    Eigen::Index row = 0;
    for (; row + kTogether <= rows; row += kTogether) {
      add_columns<kTogether>(factors + row, rows, values, count, output.data() + row);
    }
    for (; row < rows; ++row) {
      add_columns<1>(factors + row, rows, values, count, output.data() + row);
    }
  }
}

/// A quotient of polynomials, within 4e-7 of tanh; the coefficients are Eigen 3.4's.
inline float rational_tanh(float value) {
  constexpr float kLargest = 7.90531110763549805F;  // beyond, the quotient leaves [-1, 1]
  constexpr float kTiny = 0.0004F;                  // below, tanh is its argument
  const float x = std::max(std::min(value, kLargest), -kLargest);
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

/// Each value.
inline void replace_by_tanh(Eigen::VectorXf& values) {
  for (Eigen::Index i = 0; i < values.size(); ++i) values[i] = rational_tanh(values[i]);
}

}  // namespace walker
