// Many environments of one kind, stepped together by several threads.
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

class Episode;
struct EpisodeState;

/// What follows the end of an episode, with the names of Gymnasium's vector environments.
enum class AutoresetMode {
  next_step,  ///< the environment's next step is a reset: its action is ignored, its reward is 0
  same_step,  ///< the step resets at once: its observation is the new episode's first one
  disabled,   ///< a step is refused until the caller has reset the environment
};

/// "next_step", "same_step" or "disabled".
WALKER_SIM_EXPORT const char* to_text(AutoresetMode mode);

/// The mode of this name; none for any other text.
WALKER_SIM_EXPORT std::optional<AutoresetMode> find_autoreset_mode(const std::string& text);

struct PoolOptions {
  std::size_t num_envs = 1;
  std::size_t num_threads = 0;  ///< the caller's among them; 0: one per processor it may use
  AutoresetMode autoreset_mode = AutoresetMode::next_step;
  std::size_t batch_size = 0;  ///< environments that `recv` waits for; 0: all
};

/// Arrays of the caller, contiguous and row-major; results are written in place. Null arrays are
/// skipped.
struct Batch {
  double* observations = nullptr;      ///< num_envs x observation size
  double* rewards = nullptr;           ///< num_envs
  std::uint8_t* terminated = nullptr;  ///< num_envs
  std::uint8_t* truncated = nullptr;   ///< num_envs
  double* info = nullptr;              ///< num_envs x info names; NaN where absent
  std::uint32_t* episodes = nullptr;   ///< num_envs; counts the environment's resets, from 1
  std::uint32_t* steps = nullptr;      ///< num_envs; since its reset
  /// same_step only: rows of those with `terminated` or `truncated`; other rows stay as they are.
  double* final_observations = nullptr;  ///< num_envs x observation size
  double* final_info = nullptr;          ///< num_envs x info names
  float* single_observations = nullptr;  ///< as `observations`, rounded to single precision
};

/// Steps its environments with several threads, the caller's among them. Not thread-safe: one
/// thread calls. Results never depend on the number of threads. Only the constructor and the
/// first `send`, `send_resets` or `step` of some allocate memory, unless an engine fails.
///
/// An engine that fails ends the episode of its own environment; the call completes, and the other
/// rows are those of an undisturbed run.
/// - At a step: `error` returns its message. The row has `terminated`, reward 0, no info and the
///   last observation. The autoreset mode applies as after any end.
/// - At a reset, the caller's or an autoreset: `reset_error` returns its message. The reset counts
///   in `episodes`, and the episode has ended with `steps` 0: `terminated`, reward 0, no info, an
///   observation of zeros. In next_step and same_step the environment's next step is another reset
///   with the generator as it is now; disabled refuses steps until the caller resets.
/// - At the autoreset of same_step: reward, flags and final rows stay those of the step before it.
class WALKER_SIM_EXPORT Pool {
 public:
  /// @param make makes each of the environments, all alike; called in this thread
  /// @throws std::invalid_argument naming an option, its value and what is allowed, or the first
  ///         environment that differs from the others; std::system_error if no thread can start
  Pool(const std::function<std::unique_ptr<Environment>()>& make, const PoolOptions& options);
  Pool(const Pool&) = delete;
  Pool& operator=(const Pool&) = delete;
  ~Pool();

  const Specification& specification() const;
  /// The options with defaults filled in: the number of threads and the batch size are never 0.
  const PoolOptions& options() const;

  /// Begins episodes.
  /// @param environments indices; empty: all. Rows of others stay as they are
  /// @param seeds one per listed environment, or empty: their generators continue
  /// @throws std::invalid_argument naming the fault, std::logic_error if environments are under
  ///         way; then nothing has moved
  void reset(const std::vector<std::uint32_t>& environments,
             const std::vector<std::optional<std::uint64_t>>& seeds, const Batch& batch);

  /// Steps every environment once, or resets it if a reset is due.
  /// @param actions num_envs x action size, `size` values in all; finite even if ignored
  /// @throws InvalidAction, ResetNeeded naming the environment, std::logic_error if environments
  ///         are under way; then nothing has moved
  void step(const double* actions, std::size_t size, const Batch& batch);

  /// Steps some environments once, or resets those whose reset is due.
  /// @param actions      count x action size; finite even if ignored
  /// @param environments `count` indices, at least 1
  /// @param batch        receives a row for each, in their order
  /// @throws as `step`; std::invalid_argument if the list is empty, or an index is out of range or
  ///         repeated; then nothing has moved
  void step(const double* actions, const std::uint32_t* environments, std::size_t count,
            const Batch& batch);

  /// Begins to step some environments and returns at once.
  /// @param environments `count` indices of environments at rest
  /// @param actions      count x action size; copied
  /// @throws InvalidAction, ResetNeeded as `step`; std::invalid_argument if an index is out of
  ///         range or repeated, std::logic_error if an environment is under way; then nothing has
  ///         moved
  void send(const double* actions, const std::uint32_t* environments, std::size_t count);

  /// Begins to reset some environments and returns at once: `recv` writes their first rows, with
  /// reward 0. Their generators continue.
  /// @param environments as for `reset`, at rest
  /// @throws as `send`, except ResetNeeded
  void send_resets(const std::vector<std::uint32_t>& environments);

  /// Blocks until `batch_size` of the environments under way are done, and receives the first of
  /// them. The threads decide which ones these are, but not what each of them has done.
  /// @param batch        receives `batch_size` rows, in the order of completion
  /// @param environments receives the index of each row's environment, `batch_size` values
  /// @throws std::logic_error if fewer are under way
  void recv(const Batch& batch, std::uint32_t* environments);

  /// Appends an environment's state, as `Environment::save_state`, with the outcome of its present
  /// episode's last reset or step. The final state of the episode before (same_step) is not saved.
  /// @throws std::invalid_argument if the index is out of range, std::logic_error if the
  ///         environment is under way or cannot be saved
  void save_state(std::size_t index, std::vector<std::byte>& state) const;

  /// Continues environments from saved states with their `Progress::steps`; `episodes` counts each
  /// as another episode. If it has ended, the autoreset mode applies as after any end.
  /// @param environments indices; empty: all. Rows of others stay as they are
  /// @param states one per listed environment
  /// @throws as `Environment::load_state`, naming the environment; std::invalid_argument if an
  ///         index is out of range or repeated or the numbers differ, std::logic_error if
  ///         environments are under way; then nothing has changed
  void load_states(const std::vector<std::uint32_t>& environments,
                   const std::vector<std::vector<std::byte>>& states, const Batch& batch);

  /// An environment. Without same_step it may also be reset, stepped or loaded alone. This and the
  /// next five throw std::invalid_argument if the index is out of range, std::logic_error if the
  /// environment is under way.
  Environment& environment(std::size_t index);
  // For bindings and servers (src/episode/): the same, and its state after the last step or reset,
  // in same_step of the episode that this has ended.
  Episode& episode(std::size_t index);
  const EpisodeState& outcome(std::size_t index) const;
  /// The engine's message if it failed at the environment's last step; empty if it did not.
  const char* error(std::size_t index) const;
  /// The engine's message if it failed at the last reset, so that there is no episode; empty if it
  /// did not.
  const char* reset_error(std::size_t index) const;
  /// Why the environment's last step or reset ended the episode; empty if it did not.
  const char* end_reason(std::size_t index) const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace walker
