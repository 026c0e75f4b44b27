// The environment: what a server, a pool or a learner sees of a walker.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
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
  bool has_begun = false;   ///< there was a reset, possibly one that failed
  std::uint32_t steps = 0;  ///< since the reset
  double episode_return = 0;
};

/// State of NumPy's PCG64: state high and low, increment high and low, has_uint32, uinteger.
using GeneratorState = std::array<std::uint64_t, 6>;

/// A walker in its world, and its episode: the abstract environment that `make` gives. Not
/// thread-safe; distinct environments may run in distinct threads.
class WALKER_SIM_EXPORT Environment {
 public:
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;
  virtual ~Environment() = default;

  virtual const Specification& specification() const = 0;

  /// Begins an episode. With a seed the trajectory depends on nothing else; without one the
  /// generator continues (and is seeded from the system before the very first reset).
  /// @throws std::runtime_error with the engine's message if it fails; then the generator is where
  ///         the attempt left it, and only another reset is allowed
  virtual void reset(std::optional<std::uint64_t> seed, Result& result) = 0;

  /// Advances the world by `specification().dt`. An engine that fails ends the episode: the step
  /// has `terminated` and `error`, reward 0, no info and the last observation.
  /// @param action `size` values, unitless; beyond the bounds limited as Gymnasium limits them
  /// @throws InvalidAction, ResetNeeded
  virtual void step(const double* action, std::size_t size, Result& result) = 0;

  /// Measures the present state. @throws ResetNeeded
  virtual void sense(Sensors& sensors) = 0;

  /// Describes the surroundings of the present episode. @throws ResetNeeded
  virtual void scene(Scene& scene) const = 0;

  /// State of the random number generator; all zero before the first reset without a seed.
  virtual GeneratorState generator_state() const = 0;

  /// The next reset without a seed continues from `state`, as `generator_state` gave it.
  /// @throws std::invalid_argument naming the field that no generator's state has
  virtual void set_generator_state(const GeneratorState& state) = 0;

  /// Appends everything that later calls depend on: id, parameters, engine release and model, the
  /// episode with its last outcome, the robot's state, and a checksum. Equal states have equal
  /// bytes.
  virtual void save_state(std::vector<std::byte>& state) const = 0;

  /// Continues from a saved state, to the bit. All parameters must be those of the environment that
  /// saved it except `max_episode_steps`, which stays this one's.
  /// @param result receives what the last reset or step before the saving gave; its texts last
  ///               until the next call
  /// @throws std::invalid_argument naming what differs or is damaged; then nothing has changed
  virtual Progress load_state(const std::byte* state, std::size_t size, Result& result) = 0;

  /// Sets the generalized positions and velocities, as Gymnasium's `set_state` does; the episode
  /// continues from there, also if it has ended. Solver, generator and time stay as they are.
  /// @param position, velocity as the engine has them [m, rad, m/s, rad/s]
  /// @param result   receives the observation, and the info as after a reset
  /// @throws std::logic_error if the environment has no such coordinates, std::invalid_argument
  ///         naming a size or a value, ResetNeeded; then nothing has changed
  virtual void set_coordinates(const std::vector<double>& position,
                               const std::vector<double>& velocity, Result& result) = 0;

  /// Whether the robot is healthy now; none if the robot has no such notion. @throws ResetNeeded
  virtual std::optional<bool> is_healthy() const = 0;

 private:
  friend class Episode;  // the only implementation
  Environment() = default;
};

}  // namespace walker
