// The environment interface that servers, pools and learners use.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "walker_sim/errors.h"
#include "walker_sim/export.h"
#include "walker_sim/generator_state.h"
#include "walker_sim/sensors.h"
#include "walker_sim/specification.h"
#include "walker_sim/world.h"

namespace walker {

/// Outcome of a reset or a step, written into the caller's buffers.
struct Result {
  double* observation = nullptr;  ///< caller's buffer, `specification().observation_size()` values
  double* info = nullptr;         ///< caller's buffer, one value per info name; NaN: absent
  double reward = 0;              ///< 0 after a reset
  bool terminated = false;
  bool truncated = false;
  // Valid until the environment's next call.
  const char* end_reason = "";  ///< empty unless terminated or truncated
  const char* error = "";       ///< the engine's message if it failed; else empty
};

struct Progress {
  bool has_begun = false;   ///< whether there was a reset, including a failed one
  std::uint32_t steps = 0;  ///< since the reset
  double episode_return = 0;
};

/// A walker, its world and its episode; `make` creates one. Not thread-safe, but different
/// environments may run in different threads.
class WALKER_SIM_EXPORT Environment {
 public:
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;
  virtual ~Environment() = default;

  virtual const Specification& specification() const = 0;

  /// Begins an episode. With a seed, the trajectory depends only on the seed and the actions.
  /// Without one, the generator continues; if it is unseeded, the system's entropy seeds it.
  /// @throws std::runtime_error with the engine's message if the engine fails; the generator then
  ///         stays where the attempt left it, and only another reset is allowed
  virtual void reset(std::optional<std::uint64_t> seed, Result& result) = 0;

  /// Advances the world by `specification().dt`. If the engine fails, the episode ends: the step
  /// has `terminated` and `error`, reward 0, NaN info and the previous observation.
  /// @param action `size` values, unitless; values beyond the bounds are limited as in Gymnasium
  /// @throws InvalidAction, ResetNeeded
  virtual void step(const double* action, std::size_t size, Result& result) = 0;

  /// Sets the world of the resets to come. Empty: Gymnasium's.
  /// @throws std::invalid_argument as `check_world`; then nothing has changed
  virtual void set_world(const World& world) = 0;
  /// The world of the resets to come.
  virtual World world() const = 0;
  /// What the current episode has drawn from its world: numbers, and the ranges of what changes
  /// within it. As a world under the same seed it repeats the episode.
  virtual World drawn_world() const = 0;
  /// The values that act now.
  virtual WorldValues world_values() const = 0;

  /// Measures the current state; in a world with noise and delay, what sensors then measure. With a
  /// delay or dropout, measurements from before the episode's first call are not known: until newer
  /// ones are due, a call returns the first ones.
  /// @throws ResetNeeded
  virtual void sense(Sensors& sensors) = 0;

  /// Describes the surroundings in the current episode. @throws ResetNeeded
  virtual void scene(Scene& scene) const = 0;

  /// State of the random number generator; all zero while it is unseeded, i.e. before the first
  /// reset or `set_generator_state`.
  virtual GeneratorState generator_state() const = 0;

  /// Sets the state from which the next reset without a seed continues.
  /// @param state from `generator_state`
  /// @throws std::invalid_argument naming the invalid field
  virtual void set_generator_state(const GeneratorState& state) = 0;

  /// Appends everything that later calls depend on: id, parameters, engine release and model, the
  /// episode and its last outcome, the generator, the robot's state, and a checksum. Equal states
  /// have equal bytes.
  virtual void save_state(std::vector<std::byte>& state) const = 0;

  /// Continues from a saved state; the result is bitwise the same as without the round trip. All
  /// parameters must equal those of the environment that saved it, except `max_episode_steps`,
  /// which keeps this environment's value.
  /// @param result receives the outcome of the last reset or step before the save; unchanged if
  ///               the episode had not begun
  /// @throws std::invalid_argument naming what differs or is damaged; then nothing has changed
  virtual Progress load_state(const std::byte* state, std::size_t size, Result& result) = 0;

  /// Sets the generalized positions and velocities, as Gymnasium's `set_state` does. The episode
  /// continues from there, even if it has ended. Solver, generator and time are unchanged.
  /// @param position, velocity in the engine's coordinates [m, rad, m/s, rad/s]
  /// @param result   receives the observation, and the info as after a reset
  /// @throws std::logic_error if the environment has no generalized coordinates,
  ///         std::invalid_argument naming the wrong size or value, ResetNeeded; then nothing has
  ///         changed
  virtual void set_coordinates(const std::vector<double>& position,
                               const std::vector<double>& velocity, Result& result) = 0;

  /// Whether the robot is healthy; std::nullopt if this is undefined for it. @throws ResetNeeded
  virtual std::optional<bool> is_healthy() const = 0;

 private:
  friend class Walker;  // the only implementation
  Environment() = default;
};

}  // namespace walker
