// Forward pass through fully connected layers in single precision.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "walker_sim/policy.h"

namespace walker {

enum class Activation { tanh, relu };

/// Mapping of the last layer's values to the action.
enum class Output {
  clip,  ///< clipped to the limits
  tanh,  ///< their tanh, scaled to the limits
};

struct Layer {
  Eigen::MatrixXf weight;  ///< outputs x inputs
  Eigen::VectorXf bias;
};

struct Network {
  Activation activation = Activation::tanh;
  Output output = Output::clip;
  PolicyHistory history;
  Eigen::VectorXd mean;       ///< of the input
  Eigen::VectorXd deviation;  ///< of the input, above 0
  Eigen::VectorXf low;        ///< the action's limits
  Eigen::VectorXf high;
  std::vector<Layer> layers;  ///< at least one
};

/// Memory for the values of all layers in a forward pass. Each thread needs its own.
class Scratch {
 public:
  explicit Scratch(const Network& network);

  /// Whether it has the sizes of this network.
  bool fits(const Network& network) const;

 private:
  friend class Forward;
  Eigen::MatrixXf normal_;               // normalised inputs, one column per row of a batch
  std::vector<Eigen::MatrixXf> values_;  // outputs of each layer, likewise
};

/// Runs a network without allocating. Thread-safe.
class Forward {
 public:
  explicit Forward(Network network) : network_(std::move(network)) {}

  const Network& network() const { return network_; }

  /// @param inputs, actions `rows` rows; a row's action does not depend on the others
  /// @param scratch of a network with layers of the same sizes
  void act(const double* inputs, std::size_t rows, double* actions, Scratch& scratch) const;

 private:
  template <int batch>
  void run(const double* given, double* actions, Scratch& scratch) const;

  Network network_;
};

const Forward& forward_of(const Policy& policy);

}  // namespace walker
