// An episode: the one phase machine, on top of a robot.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/limits.h"
#include "base/random.h"
#include "episode/episode_record.h"
#include "episode/episode_state.h"
#include "episode/state_header.h"
#include "robots/robot.h"
#include "walker_sim/environment.h"
#include "walker_sim/export.h"
#include "walker_sim/parameters.h"
#include "walker_sim/renderer.h"

namespace walker {

struct EpisodeOptions {
  std::optional<std::uint64_t> first_seed;  ///< of the first reset, if that brings none
  bool records_actions = false;             ///< needed by `record`
};

/// Keeps phase, counts, time limit, error, last outcome, generator and, on request, the actions of
/// an episode, and calls the robot only when it may be called.
///
/// The time limit sets `truncated` on step `max_episode_steps` (0: never), also if that step
/// terminates. An engine that fails at a step ends the episode: `terminated` with `error`, reward
/// 0, no info, the observation as it was. One that fails at a reset leaves an episode that ended
/// before its first step, with an observation of zeros. After either, only a reset is allowed.
///
/// Aligned so that episodes in the hands of different threads share no cache line.
class WALKER_SIM_EXPORT Episode final : public Environment {
 public:
  explicit Episode(std::unique_ptr<Robot> robot);

  // To be called before the first reset.

  void configure(const EpisodeOptions& options);
  /// @param index within its pool
  void set_index(std::uint32_t index) { state_.environment = index; }

  const EpisodeState& state() const { return state_; }

  /// Begins an episode. If the engine fails, it has ended at once (`failed_at_reset`).
  void reset(std::optional<std::uint64_t> seed);

  /// Begins the episode that began from this state of the generator.
  /// @param seed that led to the state, for the record
  /// @throws std::invalid_argument for a state that no generator has; then nothing has changed
  void begin(const GeneratorState& generator_state, std::optional<std::uint64_t> seed);

  /// @throws InvalidAction, ResetNeeded; then nothing has changed
  void step(const double* action, std::size_t size);
  void step(const std::vector<double>& action) { step(action.data(), action.size()); }

  /// Whether `step_group` takes both: robots of one type with equal specifications.
  bool is_like(const Episode& other) const;
  std::size_t group_size() const;

  /// One member of `step_group`. The action is well-formed and the step allowed.
  struct GroupStep {
    Episode* episode;
    const double* action;
  };

  /// Steps several episodes, each as `step` does, but without checks.
  /// @param steps at most kMaxGroupSize, of distinct episodes that are alike
  static void step_group(const GroupStep* steps, std::size_t count) noexcept;

  /// As below; such an episode has no record either.
  void set_coordinates(const std::vector<double>& position, const std::vector<double>& velocity);

  /// Measurements of the present state, made at most once per state. @throws ResetNeeded
  const Sensors& sensors();
  /// Surroundings of the present episode. @throws ResetNeeded
  const Scene& scene();
  /// Copies both, for a picture. @throws ResetNeeded
  void capture(StateCapture& captured);

  // Records (episode_record.cpp).

  /// The present episode up to now.
  /// @throws std::logic_error if there is none, if it cannot be repeated, or if it is longer than
  ///         `kMaxRecordedSteps`
  EpisodeRecord record() const;
  /// Begins the episode that was recorded; `repeat` continues it.
  /// @throws std::invalid_argument naming what prevents its repetition here
  void begin(const EpisodeRecord& record);
  /// Repeats its steps, at least one, up to the last one or until about this time.
  /// @return whether the last one is done
  /// @throws std::invalid_argument naming a step that is refused, or if the sum of rewards differs
  bool repeat(const EpisodeRecord& record, std::chrono::steady_clock::time_point until);
  /// Exchanges the episodes; this one counts as the next.
  void take_over(Episode& other);

  // Saved states (saved_state.cpp).

  /// Reads and checks a state.
  /// @return puts it in place
  /// @throws as `load_state`
  std::function<void()> read_state(const std::byte* state, std::size_t size);
  /// The same as `load_state`, into `state()`. Such an episode has no record, for its beginning and
  /// its first actions are not known.
  void load_state(const std::byte* state, std::size_t size) { read_state(state, size)(); }

  // Environment, with results in the caller's buffers.

  const Specification& specification() const override { return robot_->specification(); }
  void reset(std::optional<std::uint64_t> seed, Result& result) override;
  void step(const double* action, std::size_t size, Result& result) override;
  void sense(Sensors& sensors) override;
  void scene(Scene& scene) const override;
  GeneratorState generator_state() const override;
  void set_generator_state(const GeneratorState& state) override { generator_.emplace(state); }
  void save_state(std::vector<std::byte>& state) const override;
  Progress load_state(const std::byte* state, std::size_t size, Result& result) override;
  void set_coordinates(const std::vector<double>& position, const std::vector<double>& velocity,
                       Result& result) override;
  std::optional<bool> is_healthy() const override;

 private:
  void begin_episode(std::optional<std::uint64_t> seed);
  void prepare(const double* action);
  void conclude();
  void end(const char* reason);
  void fail(const char* reason, const std::exception_ptr& thrown);
  void require_state(const char* call) const;
  void copy_to(Result& result) const;
  const StateOrigin& origin() const;

  alignas(kCacheLine) std::unique_ptr<Robot> robot_;
  EpisodeOptions options_;
  EpisodeState state_;
  RobotStep step_;                      // kept, for only the action changes
  std::optional<Generator> generator_;  // none before the first reset
  std::vector<double> actions_;         // of the present episode, step x action
  bool was_loaded_ = false;             // the first actions are not known
  bool sensors_are_fresh_ = false;
  Sensors sensors_;
  Scene scene_;
  mutable std::optional<StateOrigin> origin_;  // none before the first saved state
};

/// `make`, with the interface of this package.
WALKER_SIM_EXPORT std::unique_ptr<Episode> make_episode(const std::string& id,
                                                        const Parameters& given = {});

/// Every environment is an episode.
inline Episode& episode_of(Environment& environment) { return static_cast<Episode&>(environment); }

}  // namespace walker
