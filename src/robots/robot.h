// Interface between an episode and a simulated robot in its world.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <optional>
#include <stdexcept>
#include <vector>

#include "base/limits.h"
#include "base/random.h"
#include "base/state_bytes.h"
#include "walker_sim/export.h"
#include "walker_sim/sensors.h"
#include "walker_sim/specification.h"
#include "walker_sim/world.h"

namespace walker {

class Robot;

/// Errors of one step's measurements, to be added to the measured quantities.
struct SensorNoise {
  std::vector<double> joint_position;       ///< joints in action order [rad]
  std::vector<double> joint_velocity;       ///< [rad/s]
  double pitch = 0;                         ///< of the trunk, about the world's y [rad]
  double angular_velocity = 0;              ///< of the trunk, about the world's y [rad/s]
  std::array<double, 2> linear_velocity{};  ///< of the trunk's origin: world's x, z [m/s]
  std::vector<double> ranges;               ///< of rays that hit [m]
};

/// Adds the errors to the measurements of a step. Ranges of rays that hit stay between 0 and
/// `maximum_range`. Link poses other than the trunk's do not change.
void add(const SensorNoise& noise, Sensors& sensors);

/// Wrench on a link in the plane of motion, constant over a step, in axes of the world.
struct LinkWrench {
  std::uint32_t link = 0;  ///< index into `Specification::links`
  double force_x = 0;      ///< at the origin of the link's frame [N]
  double force_z = 0;      ///< [N]
  double torque_y = 0;     ///< [N m]
};

/// Arguments and results of one robot's step, or of its reset. A group of robots is an array of
/// these. `Walker::GroupStep` above and the engines' calls below have structs of their own,
/// because each level knows other arguments and results.
struct RobotStep {
  Robot* robot = nullptr;
  Generator* generator = nullptr;  ///< of a reset, whose results are info and failure; null: a step
  const double* action = nullptr;  ///< of a step: `action_size()` finite values [unitless]
  /// Impulse on the trunk along the world's x and z, as a constant force over the step [N s]; a
  /// reset ignores it.
  std::array<double, 2> push{};
  std::vector<LinkWrench> wrenches;                 ///< of distinct links; a reset has none
  const std::vector<LinkWrench>* forces = nullptr;  ///< constant forces of the world; null: none
  double* info = nullptr;  ///< receives one value per info name; NaN: absent
  double reward = 0;
  bool terminated = false;
  const char* end_reason = "";  ///< static text; empty unless terminated
  std::exception_ptr failure;   ///< set if the engine failed; the other results are then undefined
};

/// Robot without episode phases, time limit and seed; the episode adds these. Before the first
/// `reset` or `load`, and after a failure, the episode does not step, observe or measure.
class WALKER_SIM_EXPORT Robot {
 public:
  Robot() = default;
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;
  virtual ~Robot() = default;

  virtual const Specification& specification() const = 0;

  /// Sets level and physics for the resets to come.
  /// @param values checked; absent ones are Gymnasium's. They include those of the episode's
  ///               disturbances, which the robot ignores
  /// @throws std::exception if memory or the engine fails
  virtual void set_world(const WorldValues& values) = 0;

  /// Sets the physics of the steps to come; the level stays.
  /// @param values those of `set_world` with other numbers for parameters that can change
  /// @throws as `set_world`
  virtual void change_physics(const WorldValues& values) = 0;

  /// Draws an initial state from the generator.
  /// @param info receives one value per info name; NaN: absent
  /// @throws std::exception with the engine's message
  virtual void reset(Generator& generator, double* info) = 0;

  /// Advances the world by `specification().dt`; fills reward, termination and info.
  /// @throws std::exception with the engine's message
  virtual void step(RobotStep& step) = 0;

  /// Steps or resets several robots of this type. Each result equals that of `step` or `reset` to
  /// the bit. Robot types that step many worlds together faster than one after the other override
  /// this.
  /// @param steps at most kMaxGroupSize, of distinct robots, without a failure
  virtual void step_group(RobotStep* const* steps, std::size_t count) noexcept {
    for (RobotStep* const* each = steps; each != steps + count; ++each) {
      try {
        RobotStep& step = **each;
        if (step.generator != nullptr) {
          step.robot->reset(*step.generator, step.info);
        } else {
          step.robot->step(step);
        }
      } catch (...) {
        (*each)->failure = std::current_exception();
      }
    }
  }

  /// Group size at which `step_group` is fastest; at most kMaxGroupSize.
  virtual std::size_t group_size() const { return 1; }

  /// Writes the observation of the current state: `observation_size()` values.
  virtual void observe(double* observation) const = 0;

  /// Writes the observation that a robot's sensors with these errors give.
  virtual void observe(const SensorNoise& noise, double* observation) const = 0;

  /// Writes the measurements of the current state.
  virtual void sense(Sensors& sensors) = 0;

  /// Describes the surroundings, which only a reset changes.
  virtual void scene(Scene& scene) const = 0;

  /// Appends everything that later calls depend on. Also called before the first reset and after a
  /// failure.
  virtual void save(StateWriter& writer) const = 0;

  /// Reads and validates what `save` wrote, up to the end.
  /// @param values the argument of `set_world` in the saved episode
  /// @param is_alive whether that episode may step or be observed, so that its reset has succeeded
  /// @return a function that applies values and state; it throws at most std::bad_alloc
  /// @throws std::invalid_argument naming the error
  virtual std::function<void()> load(StateReader& reader, const WorldValues& values,
                                     bool is_alive) = 0;

  /// Sets generalized positions and velocities, as Gymnasium's `set_state` does; control and time
  /// do not change. Called only if the specification has `num_coordinates`.
  /// @param position, velocity that many finite values each
  /// @param info receives one value per info name, as after a reset
  virtual void set_coordinates(const std::vector<double>& /*position*/,
                               const std::vector<double>& /*velocity*/, double* /*info*/) {}

  /// Whether the robot is healthy; nullopt if its type does not define health.
  virtual std::optional<bool> is_healthy() const { return std::nullopt; }
};

}  // namespace walker
