// Forward pass through fully connected layers in single precision.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

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
  Eigen::VectorXd mean;       ///< of observations
  Eigen::VectorXd deviation;  ///< of observations, above 0
  Eigen::VectorXf low;        ///< the action's limits
  Eigen::VectorXf high;
  std::vector<Layer> layers;  ///< at least one
};

/// Runs a network without allocating.
class Forward {
 public:
  explicit Forward(Network network);

  const Network& network() const { return network_; }

  /// @param observations, actions `rows` rows; a row's action does not depend on the others
  void act(const double* observations, std::size_t rows, double* actions);

 private:
  template <int batch>
  void run(const double* observations, double* actions);

  Network network_;
  Eigen::MatrixXf normal_;               // normalised observations, one column per row of a batch
  std::vector<Eigen::MatrixXf> values_;  // outputs of each layer, likewise
};

}  // namespace walker
