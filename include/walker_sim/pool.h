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

class PoolSlot;

/// What becomes of an episode that has ended, as Gymnasium's vector environments name it.
enum class AutoresetMode {
  next_step,  ///< the environment's next step is a reset: its action is ignored, its reward is 0
  same_step,  ///< reset at once: the observation is the new episode's, the old one's last one final
  disabled,   ///< nothing: a step is refused until the caller has reset the environment
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

/// Arrays of the caller, contiguous and row-major; results are written in place. What is null is
/// left out.
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
};

/// Not thread-safe: one thread calls, and works too. What comes out never depends on the number of
/// threads. No call but the constructor, the first `reset` and the first `send`, `send_resets` or
/// `step` of some takes memory, unless an engine fails.
///
/// An engine that fails concerns its own environment alone: the call is made for all, and the
/// others' rows are those of an undisturbed run.
/// - At a step: `error` has its words. The row has `terminated`, reward 0, no info and the last
///   observation. What follows is what follows any end.
/// - At a reset, the caller's or an autoreset: `reset_error` has its words. The reset counts in
///   `episodes`, and the episode has ended with `steps` 0: `terminated`, reward 0, no info, an
///   observation of zeros. In next_step and same_step the environment's next step is another reset,
///   from where its generator is now; disabled refuses steps until the caller's.
/// - At the autoreset of same_step reward, flags and final rows stay those of the step before it.
class WALKER_SIM_EXPORT Pool {
 public:
  /// @param make makes each of the environments, all alike; called in this thread
  /// @throws std::invalid_argument naming an option, its value and what is allowed, or the first
  ///         environment that is not as the others; std::system_error without threads
  Pool(const std::function<std::unique_ptr<Environment>()>& make, const PoolOptions& options);
  Pool(const Pool&) = delete;
  Pool& operator=(const Pool&) = delete;
  ~Pool();

  const Specification& specification() const;
  /// As completed: the number of threads and the batch size are never 0.
  const PoolOptions& options() const;

  /// Begins episodes.
  /// @param environments which; empty: all. Rows of others stay as they are
  /// @param seeds one per listed environment, or empty: their generators continue
  /// @throws std::invalid_argument naming what is wrong, std::logic_error while some are under way;
  ///         then nothing has moved
  void reset(const std::vector<std::uint32_t>& environments,
             const std::vector<std::optional<std::uint64_t>>& seeds, const Batch& batch);

  /// Steps every environment once, or resets it where a reset is due.
  /// @param actions num_envs x action size, `size` values in all; finite also where ignored
  /// @throws InvalidAction, ResetNeeded naming the environment, std::logic_error while some are
  ///         under way; then nothing has moved
  void step(const double* actions, std::size_t size, const Batch& batch);

  /// Steps some environments once, or resets those of them where a reset is due.
  /// @param actions      count x action size; finite also where ignored
  /// @param environments which, `count` of them, at least 1
  /// @param batch        a row for each, in their order
  /// @throws as `step`; std::invalid_argument for none, for an environment that is none or for one
  ///         that is listed twice; then nothing has moved
  void step(const double* actions, const std::uint32_t* environments, std::size_t count,
            const Batch& batch);

  /// Begins to step some environments and returns at once.
  /// @param environments which, `count` of them, none of them under way
  /// @param actions      count x action size; copied
  /// @throws InvalidAction, ResetNeeded as `step`; std::invalid_argument for an environment that is
  ///         none or listed twice, std::logic_error for one that is under way; then nothing has
  ///         moved
  void send(const double* actions, const std::uint32_t* environments, std::size_t count);

  /// Begins to reset some environments and returns at once: `recv` gives their first rows, with
  /// reward 0. Their generators continue.
  /// @param environments as `reset`, none of them under way
  /// @throws as `send`, but that no episode is needed
  void send_resets(const std::vector<std::uint32_t>& environments);

  /// Waits until `batch_size` environments that were sent have arrived, and takes those that came
  /// first. Which these are depends on the threads; what each of them did does not.
  /// @param batch        rows in the order of arrival, `batch_size` of them
  /// @param environments caller's, `batch_size` values: whose row it is
  /// @throws std::logic_error when fewer are under way
  void recv(const Batch& batch, std::uint32_t* environments);

  /// Appends an environment's state, as `Environment::save_state`, with what its last reset or step
  /// gave. What an autoreset in the same step has put in its place is not kept.
  /// @throws std::invalid_argument for an index that is none, std::logic_error for an environment
  ///         that is under way or cannot be saved
  void save_state(std::size_t index, std::vector<std::byte>& state) const;

  /// Environments go on from saved states, whose `Progress::steps` they take over; `episodes`
  /// counts each as another episode. Where that has ended, what follows is what follows any end.
  /// @param environments which; empty: all. Rows of others stay as they are
  /// @param states one per listed environment
  /// @throws as `Environment::load_state`, naming the environment, std::invalid_argument for a list
  ///         that is none, std::logic_error while some are under way; then nothing has changed
  void load_states(const std::vector<std::uint32_t>& environments,
                   const std::vector<std::vector<std::byte>>& states, const Batch& batch);

  /// An environment, whose state may also be changed by itself. This and the next four throw
  /// std::invalid_argument for an index out of range, std::logic_error for an environment that is
  /// under way.
  Environment& environment(std::size_t index);
  /// What its last call gave (src/episode/pool_slot.h), for bindings that read rows in place.
  const PoolSlot& slot(std::size_t index) const;
  /// Why the simulation had to end the episode in the environment's last step; empty: it had not
  /// to.
  const char* error(std::size_t index) const;
  /// Why the environment has no episode: what its engine said at the last reset; empty: that went
  /// well, or there was none.
  const char* reset_error(std::size_t index) const;
  /// Why the environment's last step or reset ended the episode; empty: it did not.
  const char* end_reason(std::size_t index) const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace walker
