// A vector of equal environments, stepped by several threads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "walker_sim/environment.h"
#include "walker_sim/export.h"

namespace walker {

class Walker;
struct EpisodeState;

/// Behaviour at the end of an episode, named as in Gymnasium's vector environments.
enum class AutoresetMode {
  next_step,  ///< the environment's next step is a reset: its action is ignored, its reward is 0
  same_step,  ///< the step resets at once: its observation is the new episode's first one
  disabled,   ///< steps are refused until the caller has reset the environment
};

WALKER_SIM_EXPORT const char* to_text(AutoresetMode mode);

/// Returns the mode of this name; std::nullopt for any other text.
WALKER_SIM_EXPORT std::optional<AutoresetMode> find_autoreset_mode(const std::string& text);

struct PoolOptions {
  std::size_t num_envs = 1;
  /// Including the caller's; 0: one per available processor, at most `num_envs`.
  std::size_t num_threads = 0;
  AutoresetMode autoreset_mode = AutoresetMode::next_step;
  std::size_t batch_size = 0;  ///< environments that `recv` waits for; 0: all
};

/// The caller's output arrays, contiguous and row-major. Null arrays are skipped.
struct Batch {
  double* observations = nullptr;      ///< num_envs x observation size
  double* rewards = nullptr;           ///< num_envs
  std::uint8_t* terminated = nullptr;  ///< num_envs
  std::uint8_t* truncated = nullptr;   ///< num_envs
  double* info = nullptr;              ///< num_envs x info names; NaN: absent
  std::uint32_t* episodes = nullptr;   ///< num_envs; counts the environment's resets, from 1
  std::uint32_t* steps = nullptr;      ///< num_envs; since its reset
  /// same_step only: rows with `terminated` or `truncated` are written, others are unchanged.
  double* final_observations = nullptr;  ///< num_envs x observation size
  double* final_info = nullptr;          ///< num_envs x info names
  float* single_observations = nullptr;  ///< as `observations`, rounded to single precision
};

/// Steps its environments with several threads, including the caller's. Not thread-safe. Results do
/// not depend on the number of threads. The first `send`, `send_resets` or `step` of a list
/// allocates memory; later steps allocate none, unless an engine fails or allocates at a reset.
///
/// An engine that fails ends the episode of its environment. The call completes, and the other rows
/// are not affected.
/// - At a step: `error` returns its message. The row has `terminated`, reward 0, NaN info and the
///   previous observation. The autoreset mode applies as after any end.
/// - At a reset, requested or automatic: `reset_error` returns its message. The reset counts in
///   `episodes`, and the episode has ended with `steps` 0: `terminated`, reward 0, NaN info, zero
///   observation. With next_step and same_step the environment's next step is another reset, with
///   the generator as it is; with disabled, steps are refused until the caller resets.
/// - At the autoreset of same_step: reward, flags and final rows are those of the step before it.
///
/// A call that throws has moved nothing. Beyond what each names, calls throw
/// - std::invalid_argument if an index is out of range or repeated,
/// - std::logic_error if an environment that they concern is under way; for `reset`, `step` and
///   `load_states` if any is,
/// - InvalidAction, or ResetNeeded naming the environment, if they step.
class WALKER_SIM_EXPORT Pool {
 public:
  /// @param make called `num_envs` times, in this thread; must create equal environments
  /// @throws std::invalid_argument naming the invalid option, its value and the allowed values, or
  ///         the first environment that differs; std::system_error if a thread cannot start
  Pool(const std::function<std::unique_ptr<Environment>()>& make, const PoolOptions& options);
  Pool(const Pool&) = delete;
  Pool& operator=(const Pool&) = delete;
  ~Pool();

  const Specification& specification() const;
  /// The options with defaults filled in: `num_threads` and `batch_size` are never 0.
  const PoolOptions& options() const;

  /// @param environments indices; empty: all. Other rows are unchanged
  /// @param seeds one per listed environment, or empty: their generators continue
  /// @throws std::invalid_argument if the number of seeds is wrong
  void reset(const std::vector<std::uint32_t>& environments,
             const std::vector<std::optional<std::uint64_t>>& seeds, const Batch& batch);

  /// Steps every environment once, or resets it if a reset is due.
  /// @param actions num_envs x action size, `size` values in total; finite even if ignored
  /// @param on_stepped called in this thread when all are done, and under same_step before the
  ///                   ended ones are reset, with the rows as under next_step; must not step or
  ///                   reset. If it throws, the next step resets the ended ones. Empty: none
  void step(const double* actions, std::size_t size, const Batch& batch,
            const std::function<void()>& on_stepped = {});

  /// Steps the listed environments once, or resets those whose reset is due.
  /// @param actions      count x action size; finite even if ignored
  /// @param environments `count` indices, at least 1
  /// @param batch        receives a row per listed environment, in the list's order
  /// @throws std::invalid_argument if the list is empty
  void step(const double* actions, const std::uint32_t* environments, std::size_t count,
            const Batch& batch);

  /// Starts stepping the listed environments and returns at once.
  /// @param environments `count` indices
  /// @param actions      count x action size; copied
  void send(const double* actions, const std::uint32_t* environments, std::size_t count);

  /// Starts resetting the listed environments and returns at once. `recv` writes their first rows,
  /// with reward 0. Their generators continue.
  /// @param environments as for `reset`
  void send_resets(const std::vector<std::uint32_t>& environments);

  /// Blocks until `batch_size` of the environments under way are done, and receives the first
  /// `batch_size` of them. Timing determines which ones these are, but not their results.
  /// @param batch        receives `batch_size` rows, in the order of completion
  /// @param environments receives the index of each row's environment, `batch_size` values
  /// @throws std::logic_error if fewer are under way
  void recv(const Batch& batch, std::uint32_t* environments);

  /// Appends an environment's state as `Environment::save_state` does, with the outcome of the
  /// current episode's last reset or step. With same_step, the final state of the previous episode
  /// is not saved.
  void save_state(std::size_t index, std::vector<std::byte>& state) const;

  /// Continues environments from saved states. `steps` continues from the state; `episodes` counts
  /// each as another episode. If it has ended, the autoreset mode applies as after any end.
  /// @param environments indices; empty: all. Other rows are unchanged
  /// @param states one per listed environment
  /// @throws as `Environment::load_state`, naming the environment; std::invalid_argument if the
  ///         number of states is wrong
  void load_states(const std::vector<std::uint32_t>& environments,
                   const std::vector<std::vector<std::byte>>& states, const Batch& batch);

  /// Sets the worlds of the listed environments' next resets, as `Environment::set_world` does.
  /// @param environments indices; empty: all
  /// @param worlds one per listed environment, or one for all
  /// @throws std::invalid_argument as `check_world`, or if the number of worlds is wrong
  void set_world(const std::vector<std::uint32_t>& environments, const std::vector<World>& worlds);

  /// Returns an environment, which may also be reset, stepped or loaded alone. Under same_step,
  /// `error` and `end_reason` are then still those of the pool's last call.
  Environment& environment(std::size_t index);
  // For bindings and servers (src/episode/): the environment as a Walker, and its state after the
  // last step or reset. If same_step has just reset it, that is the ended episode's final state.
  Walker& walker(std::size_t index);
  const EpisodeState& outcome(std::size_t index) const;
  /// The engine's message if it failed at the last step; else empty.
  const char* error(std::size_t index) const;
  /// The engine's message if it failed at the last reset, so that there is no episode; else empty.
  const char* reset_error(std::size_t index) const;
  /// Why the last step or reset ended the episode; empty if it did not.
  const char* end_reason(std::size_t index) const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace walker
