// A walker: one robot and its episodes, their states and records. All environments share it.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/limits.h"
#include "base/random.h"
#include "episode/checked_world.h"
#include "episode/disturbances.h"
#include "episode/saved_state.h"
#include "robots/robot.h"
#include "walker_sim/environment.h"
#include "walker_sim/export.h"
#include "walker_sim/parameters.h"
#include "walker_sim/pool.h"
#include "walker_sim/renderer.h"

namespace walker {

// End reasons if the engine fails.
inline constexpr const char* kStepFailed = "the simulation failed";
inline constexpr const char* kResetFailed = "the simulation failed at its reset";

/// The fields of a transition. Units as in Transition.msg.
struct EpisodeState {
  std::uint32_t environment = 0;  ///< index within its pool
  std::uint32_t episode = 0;      ///< counts resets from 1; 0: no reset yet
  std::uint32_t step = 0;         ///< since the reset
  std::vector<double> action;     ///< of the last step, as given; empty right after a reset
  std::vector<double> observation;
  std::vector<double> info;
  double reward = 0;
  double episode_return = 0;
  bool terminated = false;
  bool truncated = false;
  std::string end_reason;  ///< "terminated: ..." or "truncated: ..."; empty: the episode runs
  std::string error;       ///< the engine's message if it failed; else empty
  std::optional<std::uint64_t> seed;   ///< of the reset; nullopt: the generator continued
  GeneratorState generator_state{};    ///< before the reset
  std::shared_ptr<const World> world;  ///< drawn at the reset; null: Gymnasium's world

  bool has_begun() const { return episode != 0; }
  bool has_ended() const { return terminated || truncated; }
  /// Whether the engine failed at the reset, so that there is no state to observe.
  bool failed_at_reset() const { return step == 0 && has_ended(); }
  /// Why a step is refused, e.g. "the episode ended after 3 steps"; empty if it is allowed.
  std::string step_refusal() const;
  /// The same for a step of a vector environment, whose autoreset may allow steps after the end.
  std::string step_refusal(AutoresetMode mode) const;
  /// What the reset has drawn, numbers and the ranges of what changes within the episode; empty in
  /// Gymnasium's world.
  WALKER_SIM_EXPORT const World& drawn_world() const;
  /// `end_reason` without "terminated: " or "truncated: ".
  const char* end_reason_detail() const;
};

/// A push by hand.
struct RecordedPush {
  std::uint32_t step = 0;  ///< in which it acted, from 1
  LinkWrench wrench;
};

/// Coordinates that were set within an episode.
struct RecordedCoordinates {
  std::uint32_t step = 0;  ///< after which they were set; 0: the reset
  std::vector<double> position;
  std::vector<double> velocity;
};

/// A record of an episode that suffices to repeat it with bitwise equal results.
struct EpisodeRecord {
  std::string id;
  std::vector<std::pair<std::string, std::string>> parameters;  ///< complete, values as text
  std::string engine;
  std::string engine_version;
  std::optional<std::uint64_t> seed;  ///< of the reset; nullopt: the generator continued
  GeneratorState generator_state{};   ///< before the reset
  World world;                        ///< as drawn at the reset
  std::uint32_t num_steps = 0;
  std::vector<double> actions;       ///< steps x action size, as given [unitless]
  std::vector<RecordedPush> pushes;  ///< in the order of step and link, one per step and link
  std::vector<RecordedCoordinates> coordinates;  ///< in the order in which they were set
  /// Checksums of the transitions, the reset's first (EpisodeRecord.msg has the formula). They are
  /// verified when the record is repeated; empty: not compared.
  std::vector<std::uint64_t> checksums;
};

/// Returns a record with only the origin: id, parameters, engine and its version.
WALKER_SIM_EXPORT EpisodeRecord describe_origin(const Specification& specification);

/// Checks that an environment of this specification repeats the record with bitwise equal results.
/// @throws std::invalid_argument naming the first field that differs or is malformed, with both
///         values, or if episodes of the environment depend on earlier ones
WALKER_SIM_EXPORT void check_repeatable(const EpisodeRecord& record,
                                        const Specification& specification);

/// @throws std::invalid_argument naming the link, or the component that is too large or not finite
void check_wrench(const LinkWrench& wrench, const Specification& specification);

struct WalkerOptions {
  std::optional<std::uint64_t> first_seed;  ///< used if the first reset has no seed
  bool records_actions = false;             ///< required by `record` and `repeat`
};

/// One robot and its episodes, one after the other: phase, step count, time limit, error, last
/// outcome, generator and, optionally, the actions. Calls the robot only in phases that allow it.
///
/// The time limit sets `truncated` on step `max_episode_steps` (0: never), also if that step
/// terminates. If the engine fails at a step, the episode ends: `terminated` with `error`, reward
/// 0, NaN info, unchanged observation. If it fails at a reset, the episode has ended before its
/// first step, with a zero observation. After either, only a reset is allowed.
///
/// Cache-line aligned, so that walkers stepped by different threads share no cache line.
class WALKER_SIM_EXPORT Walker final : public Environment {
 public:
  explicit Walker(std::unique_ptr<Robot> robot);

  // Configuration, before the first reset.

  void configure(const WalkerOptions& options);
  /// @param index within its pool
  void set_index(std::uint32_t index) { state_.environment = index; }

  /// Sets the world of the resets to come. Walkers may share one. Null: Gymnasium's.
  /// @param world checked for this specification
  void set_world(std::shared_ptr<const CheckedWorld> world) { world_ = std::move(world); }

  const EpisodeState& state() const { return state_; }

  /// Begins an episode. If the engine fails, the episode has ended at once (`failed_at_reset`).
  void reset(std::optional<std::uint64_t> seed);

  /// @throws InvalidAction, ResetNeeded; then nothing has changed
  void step(const double* action, std::size_t size);
  void step(const std::vector<double>& action) { step(action.data(), action.size()); }

  /// Adds a wrench to the next step, or replaces that step's wrench on the same link; a wrench of
  /// zeros cancels it. A reset, a loaded state and a restored record drop it; saved states do not
  /// have it.
  /// @throws ResetNeeded; std::invalid_argument naming the value that is wrong; std::logic_error if
  ///         the record has no room for another; then nothing has changed
  void push(const LinkWrench& wrench);

  /// Whether both may be in one `step_group`: same robot type, id, parameters and sizes.
  bool can_step_together(const Walker& other) const;
  std::size_t group_size() const;

  /// One member of `step_group`. The caller has checked the action and that a step is allowed.
  struct GroupStep {
    Walker* walker;
    const double* action;                              ///< null: a reset
    std::optional<std::uint64_t> seed = std::nullopt;  ///< of the reset
  };

  /// Steps or resets several walkers, each as `step` or `reset` does, but without checks.
  /// @param steps at most kMaxGroupSize distinct walkers that are pairwise `can_step_together`
  static void step_group(const GroupStep* steps, std::size_t count) noexcept;

  /// As the override below, into `state()`. @throws std::logic_error also if the record has no room
  void set_coordinates(const std::vector<double>& position, const std::vector<double>& velocity);

  /// The current state as exact measurements, cached until it changes. @throws ResetNeeded
  const Sensors& sensors();
  /// What the world lets sensors measure now, as the observation. Equals `sensors()` in Gymnasium's
  /// world. @throws ResetNeeded
  const Sensors& measurements();
  /// The step at which `measurements()` were made.
  std::uint32_t measured_step() const { return measured_step_; }
  /// How long the world delays observations [steps].
  std::uint32_t observation_delay() const {
    return disturbances_ ? disturbances_->observation_delay() : 0;
  }
  /// The step at which the present observation was measured.
  std::uint32_t observed_step() const {
    return disturbances_ ? disturbances_->observed_step() : state_.step;
  }
  /// Surroundings in the current episode. @throws ResetNeeded
  const Scene& scene();
  /// Copies both for a renderer. @throws ResetNeeded
  void capture(StateCapture& captured);

  // Records (episode_record.cpp).

  /// Returns a record of the current episode up to its last step.
  /// @throws std::logic_error if there is no episode, if it cannot be repeated, or if it has more
  ///         than `kMaxRecordedSteps` steps
  EpisodeRecord record() const;
  /// Begins a recorded episode; `repeat` makes its steps.
  /// @throws std::invalid_argument naming why it cannot be repeated here
  void begin(const EpisodeRecord& record);
  /// Repeats the record's remaining steps, at least one, until about `until`.
  /// @return whether all steps are done
  /// @throws std::invalid_argument naming the first step that fails or whose checksum differs
  bool repeat(const EpisodeRecord& record, std::chrono::steady_clock::time_point until);
  /// Swaps the two episodes. Here the other one counts as the next episode.
  void take_over(Walker& other);

  // Saved states (saved_state.cpp).

  /// Reads and checks a state without changing the walker.
  /// @return a function that loads the state
  /// @throws as `load_state`
  std::function<void()> read_state(const std::byte* state, std::size_t size);
  /// As the override below, into `state()`. The episode can then not be recorded, since its first
  /// actions are unknown.
  void load_state(const std::byte* state, std::size_t size) { read_state(state, size)(); }

  // Overrides of Environment, with results in the caller's buffers.

  const Specification& specification() const override { return robot_->specification(); }
  void reset(std::optional<std::uint64_t> seed, Result& result) override;
  void step(const double* action, std::size_t size, Result& result) override;
  void set_world(const World& world) override;
  World world() const override { return world_ ? world_->ranges() : World{}; }
  World drawn_world() const override { return state_.drawn_world(); }
  WorldValues world_values() const override { return values_ ? values_->present() : WorldValues{}; }
  void sense(Sensors& sensors) override;
  void scene(Scene& scene) const override;
  GeneratorState generator_state() const override;
  void set_generator_state(const GeneratorState& state) override { generator_ = Generator(state); }
  void save_state(std::vector<std::byte>& state) const override;
  Progress load_state(const std::byte* state, std::size_t size, Result& result) override;
  void set_coordinates(const std::vector<double>& position, const std::vector<double>& velocity,
                       Result& result) override;
  std::optional<bool> is_healthy() const override;

 private:
  void take_seed(std::optional<std::uint64_t>& seed);
  void begin_episode(std::optional<std::uint64_t> seed,
                     const std::shared_ptr<const World>& recorded = nullptr);
  bool prepare_reset(std::optional<std::uint64_t> seed,
                     const std::shared_ptr<const World>& recorded = nullptr);
  void prepare_world(std::shared_ptr<const World> drawn);
  void observe();
  void forget_sensors();
  void conclude_reset();
  bool prepare(const double* action);
  void change_physics();
  void conclude();
  void take_outcome();
  void end(const char* reason);
  void fail(const char* reason, const std::exception_ptr& thrown);
  void require_state(const char* call) const;
  void record_checksum();
  void require_checksum(const EpisodeRecord& record) const;
  void repeat_pushes(const EpisodeRecord& record);
  const RecordedCoordinates* next_coordinates(const EpisodeRecord& record) const;
  void add_wrench(const LinkWrench& wrench);
  void copy_to(Result& result) const;
  const StateOrigin& origin() const;

  alignas(kCacheLine) std::unique_ptr<Robot> robot_;
  WalkerOptions options_;
  EpisodeState state_;
  RobotStep step_;                              // reused: robot and info stay the same
  std::optional<Generator> generator_;          // nullopt before the first reset
  std::shared_ptr<const CheckedWorld> world_;   // of the resets to come; null: Gymnasium's
  std::optional<EpisodeValues> values_;         // of the current episode; nullopt: Gymnasium's
  std::unique_ptr<Disturbances> disturbances_;  // of the current episode; null: it has none
  std::vector<double> actions_;                 // of the current episode, steps x action size
  std::vector<RecordedPush> pushes_;            // of the current episode
  std::vector<RecordedCoordinates> coordinates_;
  std::vector<std::uint64_t> checksums_;  // of the current episode, of the reset and each step
  bool was_loaded_ = false;               // the episode's first actions are unknown
  bool sensors_are_fresh_ = false;
  bool measurements_are_fresh_ = false;
  Sensors sensors_;
  Sensors measurements_;
  std::uint32_t measured_step_ = 0;
  Scene scene_;
  mutable std::optional<StateOrigin> origin_;  // nullopt until a state is saved or read
};

/// As `make`, with the internal interface.
WALKER_SIM_EXPORT std::unique_ptr<Walker> make_walker(const std::string& id,
                                                      const Parameters& given = {});

/// Downcast: Walker is the only implementation of Environment.
inline Walker& walker_of(Environment& environment) { return static_cast<Walker&>(environment); }

}  // namespace walker
