// Computes the environment's observation from a robot's sensor measurements.
#pragma once

#include "walker_sim/export.h"
#include "walker_sim/sensors.h"

namespace walker {

/// Builds the observations of one environment. Not thread-safe.
///
/// From a simulated walker's measurements it reproduces the environment's observation up to
/// rounding: each value within 1.2e-7 (2^-23, single precision) for BipedalWalker and for ranges,
/// which a scan has in single precision, and within 1e-12 for the rest of Walker2d and Hopper.
/// Tests check these bounds.
class WALKER_SIM_EXPORT ObservationBuilder {
 public:
  ObservationBuilder() = default;
  ObservationBuilder(const ObservationBuilder&) = delete;
  ObservationBuilder& operator=(const ObservationBuilder&) = delete;
  virtual ~ObservationBuilder() = default;

  /// Begins an episode. The trunk's pitch is assumed to be within half a turn of the walker's start
  /// pose. From then on the pitch is unwrapped, as engines count whole turns and orientations do
  /// not; so the trunk must turn by less than half a turn between two calls of `build`.
  virtual void reset() = 0;

  /// @param observation caller's buffer, the environment's `observation_size()` values
  /// @throws std::invalid_argument naming the measurement, its value and the allowed values if a
  ///         size is wrong or a value that the observation needs is invalid; `observation` is then
  ///         unchanged
  virtual void build(const Measurements& measurements, double* observation) = 0;
};

}  // namespace walker
