// Fully connected layers, in single precision.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace walker {

enum class Activation { tanh, relu };

/// What a network's last values become.
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
  /// For the first `batch` rows.
  template <int batch>
  void run(const double* observations, double* actions);

  Network network_;
  Eigen::MatrixXf normal_;               // a column for each row that is computed together
  std::vector<Eigen::MatrixXf> values_;  // after each layer, likewise
};

}  // namespace walker
