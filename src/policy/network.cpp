#include "policy/network.h"

#include <algorithm>
#include <cstddef>

#include "policy/arithmetic.h"

namespace walker {
namespace {

// As in VecNormalize of Stable-Baselines3, whose normalisation this is.
constexpr double kObservationClip = 10;

// Number of rows computed together: each weight is loaded once for all of them.
constexpr int kBatch = 4;

#ifdef __x86_64__

/// For processors with AVX2; the results are bit-identical.
template <int batch>
__attribute__((target("avx2"))) void apply_weight_avx2(const Layer& layer, const float* inputs,
                                                       float* outputs) {
  add_product<8, batch>(layer.weight.data(), layer.weight.rows(), layer.weight.cols(), inputs,
                        outputs);
}

__attribute__((target("avx2"))) void apply_tanh_avx2(float* values, std::ptrdiff_t count) {
  replace_by_tanh(values, count);
}

#endif

template <int batch>
void apply_weight(const Layer& layer, const float* inputs, float* outputs) {
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx2")) return apply_weight_avx2<batch>(layer, inputs, outputs);
#endif
  add_product<4, batch>(layer.weight.data(), layer.weight.rows(), layer.weight.cols(), inputs,
                        outputs);
}

void apply_tanh(float* values, std::ptrdiff_t count) {
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx2")) return apply_tanh_avx2(values, count);
#endif
  replace_by_tanh(values, count);
}

}  // namespace

Scratch::Scratch(const Network& network) : normal_(network.mean.size(), kBatch) {
  for (const Layer& layer : network.layers) values_.emplace_back(layer.bias.size(), kBatch);
}

bool Scratch::fits(const Network& network) const {
  return normal_.rows() == network.mean.size() &&
         std::equal(values_.begin(), values_.end(), network.layers.begin(), network.layers.end(),
                    [](const Eigen::MatrixXf& values, const Layer& layer) {
                      return values.rows() == layer.bias.size();
                    });
}

void Forward::act(const double* inputs, std::size_t rows, double* actions, Scratch& scratch) const {
  const auto input_size = static_cast<std::size_t>(network_.mean.size());
  const auto action_size = static_cast<std::size_t>(network_.low.size());
  std::size_t row = 0;
  for (; row + kBatch <= rows; row += kBatch) {
    run<kBatch>(inputs + row * input_size, actions + row * action_size, scratch);
  }
  for (; row < rows; ++row) {
    run<1>(inputs + row * input_size, actions + row * action_size, scratch);
  }
}

template <int batch>
void Forward::run(const double* given, double* actions, Scratch& scratch) const {
  const Eigen::Index size = network_.mean.size();
  for (int k = 0; k < batch; ++k) {
    const Eigen::Map<const Eigen::VectorXd> input(given + k * size, size);
    scratch.normal_.col(k) = ((input - network_.mean).array() / network_.deviation.array())
                                 .max(-kObservationClip)
                                 .min(kObservationClip)
                                 .cast<float>();
  }
  const float* inputs = scratch.normal_.data();
  for (std::size_t i = 0; i < network_.layers.size(); ++i) {
    const Layer& layer = network_.layers[i];
    auto outputs = scratch.values_[i].leftCols<batch>();
    outputs.colwise() = layer.bias;
    apply_weight<batch>(layer, inputs, outputs.data());
    const bool is_last = i + 1 == network_.layers.size();
    if (is_last ? network_.output == Output::tanh : network_.activation == Activation::tanh) {
      apply_tanh(outputs.data(), outputs.size());
    } else if (!is_last) {
      outputs.array() = outputs.array().max(0.0F);
    }
    inputs = outputs.data();
  }
  for (int k = 0; k < batch; ++k) {
    auto last = scratch.values_.back().col(k);
    if (network_.output == Output::tanh) {
      last.array() =
          network_.low.array() + (network_.high - network_.low).array() / 2 * (last.array() + 1.0F);
    }
    last = last.cwiseMax(network_.low).cwiseMin(network_.high);
    Eigen::Map<Eigen::VectorXd>(actions + k * last.size(), last.size()) = last.cast<double>();
  }
}

}  // namespace walker
