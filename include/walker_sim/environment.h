// The abstract environment: all that a server, a pool or a learner knows of a walker.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "walker_sim/export.h"
#include "walker_sim/sensors.h"
#include "walker_sim/specification.h"

namespace walker {

/// The action has the wrong size or is not finite. Nothing has moved.
struct WALKER_SIM_EXPORT InvalidAction : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

/// A step without a running episode: before the first reset, or after the end. Nothing has moved.
struct WALKER_SIM_EXPORT ResetNeeded : std::logic_error {
  using std::logic_error::logic_error;
};

/// Outcome of a reset or a step, written into the caller's buffers.
struct Result {
  double* observation = nullptr;  ///< caller's, `specification().observation_size()` values
  double* info = nullptr;         ///< caller's, one per info name; NaN where absent
  double reward = 0;              ///< 0 after a reset
  bool terminated = false;
  bool truncated = false;
  const char* end_reason = "";  ///< static text; empty unless terminated or truncated
  const char* error = "";       ///< static text: why the simulation had to end the episode
};

/// How far an episode has come.
struct Progress {
  bool has_begun = false;   ///< there was a reset, be it one that failed
  std::uint32_t steps = 0;  ///< since the reset
  double episode_return = 0;
};

/// State of NumPy's PCG64: state high and low, increment high and low, has_uint32, uinteger.
using GeneratorState = std::array<std::uint64_t, 6>;

class Environment;

/// One of several calls of `step` that are made together.
struct StepCall {
  Environment* environment = nullptr;
  const double* action = nullptr;
  Result* result = nullptr;
  std::exception_ptr failure;  ///< what `step` would have thrown
};

/// One walker in its world. Not thread-safe; distinct environments may run in distinct threads.
class WALKER_SIM_EXPORT Environment {
 public:
  Environment() = default;
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;
  virtual ~Environment() = default;

  virtual const Specification& specification() const = 0;

  /// Begins an episode. With a seed the trajectory depends on nothing else; without one the
  /// generator continues (and is seeded from the system before the very first reset).
  /// @throws std::exception with the engine's words where it fails; then the result is of no
  ///         meaning, the generator where the attempt left it, and only another reset is allowed
  virtual void reset(std::optional<std::uint64_t> seed, Result& result) = 0;

  /// Advances the world by `specification().dt`.
  /// @param action      `size` values, unitless; beyond the bounds limited as Gymnasium limits them
  /// @throws InvalidAction, ResetNeeded. What an engine throws never leaves an environment that
  ///         `make` made: it ends the episode with `error`.
  virtual void step(const double* action, std::size_t size, Result& result) = 0;

  /// Steps several environments, each as `step` does it. A type that advances many worlds at once
  /// faster than one after the other overrides this.
  /// @param calls at most `kLargestGroup`, without a failure yet; their environments are distinct
  ///              and of this one's kind
  /// @param size  values of each action
  virtual void step_together(StepCall* const* calls, std::size_t count, std::size_t size) noexcept;

  static constexpr std::size_t kLargestGroup = 64;

  /// How many environments `step_together` best takes, at most `kLargestGroup`: a pool hands it as
  /// many where it can, and never more.
  virtual std::size_t group_size() const { return 1; }

  /// Measures the present state. Needs a reset before.
  virtual void sense(Sensors& sensors) = 0;

  /// Describes the surroundings of the present episode. Needs a reset before.
  virtual void scene(Scene& scene) const = 0;

  /// The random number generator's state; before the first reset without a seed all zero.
  virtual GeneratorState generator_state() const = 0;

  /// The next reset without a seed continues from `state`, as `generator_state` gave it.
  /// @throws std::invalid_argument naming what no generator's state has
  virtual void set_generator_state(const GeneratorState& state) = 0;

  /// Whether the state can be saved as bytes and loaded again, in a time that depends on its size
  /// alone. Where it cannot, an episode can only be repeated.
  virtual bool can_save_state() const { return false; }

  /// Appends all that decides about what follows. An environment that `make` made puts before it of
  /// which id, parameters, engine release and model it is the state, and a checksum.
  ///
  /// States that lead to the same have the same bytes, whatever makes the steps.
  /// @param last what the last reset or step gave, to be kept with the state; unused before those
  /// @throws std::logic_error where `can_save_state` is false
  virtual void save_state(const Result& last, std::vector<std::byte>& state) const;

  /// Goes on from a saved state, to the bit, whatever went before. All parameters must be those of
  /// the environment that saved it but `max_episode_steps`, which is this one's.
  /// @param last receives what `save_state` was given, where there was a reset; its texts last
  ///             until the environment's next call. Null: the state is only looked at
  /// @throws std::invalid_argument naming what the state is of instead, or what of it is damaged,
  ///         std::logic_error where `can_save_state` is false; then nothing has changed
  virtual Progress load_state(const std::byte* state, std::size_t size, Result* last);

  /// Sets the generalized positions and velocities, as Gymnasium's `set_state` does, and goes on
  /// from there, also where the episode has ended. Solver, generator and time stay as they are.
  /// @param position, velocity as the engine has them [m, rad, m/s, rad/s]
  /// @param result   receives the observation, and the info as after a reset
  /// @throws std::logic_error if the environment has no such coordinates, std::invalid_argument
  ///         naming a size or a value, ResetNeeded; then nothing has changed
  virtual void set_coordinates(const std::vector<double>& position,
                               const std::vector<double>& velocity, Result& result);

  /// Whether the robot is healthy now; none: the environment does not tell. Needs a reset before.
  virtual std::optional<bool> is_healthy() const { return std::nullopt; }
};

}  // namespace walker
