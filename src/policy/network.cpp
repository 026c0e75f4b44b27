#include "policy/network.h"

#include <cstddef>
#include <utility>

#include "policy/arithmetic.h"

namespace walker {
namespace {

// As VecNormalize of Stable-Baselines3, whose normalisation this is.
constexpr double kObservationClip = 10;

}  // namespace

Forward::Forward(Network network) : network_(std::move(network)), normal_(network_.mean.size()) {
  for (const Layer& layer : network_.layers) values_.emplace_back(layer.bias.size());
}

void Forward::act(const double* observation, double* action) {
  const Eigen::Map<const Eigen::VectorXd> measured(observation, network_.mean.size());
  normal_ = ((measured - network_.mean).array() / network_.deviation.array())
                .max(-kObservationClip)
                .min(kObservationClip)
                .cast<float>();
  const Eigen::VectorXf* input = &normal_;
  for (std::size_t i = 0; i < network_.layers.size(); ++i) {
    const Layer& layer = network_.layers[i];
    Eigen::VectorXf& output = values_[i];
    output = layer.bias;
    add_product(layer.weight, *input, output);
    if (i + 1 < network_.layers.size()) {
      if (network_.activation == Activation::tanh) {
        replace_by_tanh(output);
      } else {
        output.array() = output.array().max(0.0F);
      }
    }
    input = &output;
  }
  Eigen::VectorXf& last = values_.back();
  if (network_.output == Output::tanh) {
    replace_by_tanh(last);
    last.array() =
        network_.low.array() + (network_.high - network_.low).array() / 2 * (last.array() + 1.0F);
  }
  last = last.cwiseMax(network_.low).cwiseMin(network_.high);
  Eigen::Map<Eigen::VectorXd>(action, last.size()) = last.cast<double>();
}

}  // namespace walker
