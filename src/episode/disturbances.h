// What a world does to an episode beyond its robot's level and physics: pushes, and delays and
// errors of actions and measurements.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "base/random.h"
#include "base/state_bytes.h"
#include "robots/robot.h"
#include "walker_sim/world.h"

namespace walker {

/// The disturbances of one episode. Their generators derive from the episode's as the values' do.
///
/// Step k, from 1, has a time of k dt. Delays d and the period of pushes are whole steps, d =
/// round(seconds / dt). n is a standard normal number, drawn anew for each use:
///
///   action       action_(k-d) + action_noise n; for k <= d, 0 + action_noise n. Not clamped
///   push         on the trunk, along x and z: (LINK_force_x, LINK_force_z) dt [N s]; if k is a
///   multiple of
///                the period, plus the impulse push_impulse (cos u, sin u), u uniform in [0, 2 pi)
///   forces       on the other links: (LINK_force_x, LINK_force_z) [N]
///   noise        each measured quantity (joints, trunk, ranges) + its deviation * n; observation
///                and sensors of a state have the same errors
///   observation  that of step max(k - d, 0); except after a reset, with the probability `dropout`
///                the last delivered one again
///   sensors      those of the step of the observation
///
/// Inputs: actions, the robot's measurements. State: three generators, the actions and observations
/// in transit, the last delivered observation. The model is this package's own; docs/worlds.md has
/// the parameters.
class Disturbances {
 public:
  /// @param values of a world that the environment can apply
  Disturbances(const WorldValues& values, const Specification& specification,
               const GeneratorState& episode);

  /// Whether any of the values is for this class.
  static bool has_any(const WorldValues& values);

  /// Sets the constant forces of the steps to come.
  void set_forces(const WorldValues& values);

  /// Sets action, push and forces of a step: the action of `action_delay` before, plus an error.
  /// @param step of the step to make, from 1
  void begin_step(const double* action, std::uint32_t step, RobotStep& robot_step);

  /// Writes the observation after a step or a reset: with errors, that of `observation_delay`
  /// before, or the last one again.
  /// @param step 0 after a reset
  void observe(Robot& robot, std::uint32_t step, double* observation);

  /// Measures as `observe` does. Delayed measurements are known from the first call on.
  /// @return the step at which they were made; later than `observed_step` if those of that step are
  ///         not known
  std::uint32_t measure(Robot& robot, Sensors& sensors);

  std::uint32_t observation_delay() const { return observation_delay_; }  ///< [steps]

  /// The step at which the present observation was measured.
  std::uint32_t observed_step() const { return observed_step_; }

  /// Forgets what was observed and measured before: the robot has been put into another state.
  void forget_past();

  void save(StateWriter& writer) const;
  /// @throws std::invalid_argument if the state is damaged
  void load(StateReader& reader);

 private:
  /// Measurements and their step.
  struct Measured {
    std::uint32_t step;
    Sensors sensors;
  };

  void draw_noise();
  void sense(Robot& robot, Sensors& sensors) const;
  void remember_sensors(Robot& robot);
  bool is_delayed() const { return observation_delay_ != 0 || dropout_ > 0; }

  std::vector<std::string> link_names_;
  double dt_;                              // [s]
  std::array<double, 2> constant_push_{};  // in each step, along x and z [N s]
  std::vector<LinkWrench> forces_;         // on links other than the trunk
  std::uint32_t push_period_ = 0;          // steps; 0: no pushes
  std::uint32_t action_delay_;             // steps
  std::uint32_t observation_delay_;        // steps
  bool has_noise_ = false;
  bool ranges_are_optional_;
  double push_impulse_ = 0;  // [N s]
  double action_noise_, dropout_;
  // Standard deviations.
  double joint_position_noise_, joint_velocity_noise_, orientation_noise_, angular_velocity_noise_,
      linear_velocity_noise_, range_noise_;

  Generator push_generator_, action_generator_, sensing_generator_;
  std::uint32_t step_ = 0;
  std::uint32_t observed_step_ = 0;
  SensorNoise noise_;                             // of the present state
  std::vector<double> action_;                    // as it acts
  std::deque<std::vector<double>> actions_;       // to act in later steps
  std::deque<std::vector<double>> observations_;  // of the last steps, the present one last
  std::vector<double> observed_;                  // the last one that was delivered
  std::deque<Measured> measured_;                 // empty: nobody has asked
  std::vector<double> normals_;                   // reused
};

}  // namespace walker
