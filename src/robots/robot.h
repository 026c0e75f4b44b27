// A walker and its world: the narrow interface below an episode.
#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <optional>
#include <vector>

#include "base/limits.h"
#include "base/random.h"
#include "base/state_bytes.h"
#include "walker_sim/export.h"
#include "walker_sim/sensors.h"
#include "walker_sim/specification.h"

namespace walker {

class Robot;

/// A step of one robot: what it is given, and what comes of it.
struct RobotStep {
  Robot* robot = nullptr;
  const double* action = nullptr;  ///< `action_size()` finite values [unitless]
  double* info = nullptr;          ///< receives a value per info name; NaN: absent
  double reward = 0;
  bool terminated = false;
  const char* end_reason = "";  ///< static text; empty unless terminated
  std::exception_ptr failure;   ///< set if the engine failed; then the rest has no meaning
};

/// Knows no phase of an episode, no time limit and no seed. Its episode calls it in order: `reset`
/// before anything else, and after a failure only `reset`.
class WALKER_SIM_EXPORT Robot {
 public:
  Robot() = default;
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;
  virtual ~Robot() = default;

  virtual const Specification& specification() const = 0;

  /// Puts the robot into a first state, drawn from the generator.
  /// @param info receives a value per info name; NaN: absent
  /// @throws std::exception with the engine's message
  virtual void reset(Generator& generator, double* info) = 0;

  /// Advances the world by `specification().dt`; fills reward, termination and info.
  /// @throws std::exception with the engine's message
  virtual void step(RobotStep& step) = 0;

  /// Makes the steps of several robots of this type, each to the bit as `step` makes it. A type
  /// that advances many worlds together faster than one after the other overrides this.
  /// @param steps at most kMaxGroupSize, of distinct robots, without a failure
  virtual void step_group(RobotStep* const* steps, std::size_t count) noexcept;

  /// The group size at which `step_group` is fastest, at most kMaxGroupSize.
  virtual std::size_t group_size() const { return 1; }

  /// Writes `observation_size()` values: the observation of the present state.
  virtual void observe(double* observation) const = 0;

  /// Measures the present state.
  virtual void sense(Sensors& sensors) = 0;

  /// Describes the surroundings, which change at a reset only.
  virtual void scene(Scene& scene) const = 0;

  /// Appends everything that later calls depend on. Also called before the first reset and after a
  /// failure.
  virtual void save(StateWriter& writer) const = 0;

  /// Reads and checks what `save` wrote, up to the end.
  /// @return puts the state in place; fails only for want of memory
  /// @throws std::invalid_argument naming what is wrong
  virtual std::function<void()> load(StateReader& reader) = 0;

  /// Sets generalized positions and velocities; solver and time stay as they are.
  /// @param info receives a value per info name, as after a reset
  /// @throws std::logic_error if the robot has no such coordinates, std::invalid_argument naming a
  ///         size or a value
  virtual void set_coordinates(const std::vector<double>& position,
                               const std::vector<double>& velocity, double* info);

  /// Whether the robot is healthy now; none if it has no such notion.
  virtual std::optional<bool> is_healthy() const { return std::nullopt; }
};

}  // namespace walker
