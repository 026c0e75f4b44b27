// An environment that knows how its episode came about.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "episode/episode_record.h"
#include "base/limits.h"
#include "walker_sim/environment.h"
#include "walker_sim/export.h"
#include "walker_sim/renderer.h"

namespace walker {

/// Everything about the present state that a transition tells. Units as in Transition.msg.
struct EpisodeState {
  std::uint32_t environment = 0;  ///< index within its server
  std::uint32_t episode = 0;      ///< counts resets, from 1; 0: none yet
  std::uint32_t step = 0;
  std::vector<double> action;  ///< of the last step, as given; empty right after a reset
  std::vector<double> observation;
  std::vector<double> info;
  double reward = 0;
  double episode_return = 0;
  bool terminated = false;
  bool truncated = false;
  /// Empty while the episode runs; else "terminated: ..." or "truncated: ...".
  std::string end_reason;
  std::string error;
  /// With which the episode began; none: the generator continued.
  std::optional<std::uint64_t> seed;
  GeneratorState generator_state{};  ///< before the reset

  bool has_ended() const { return terminated || truncated; }
  /// The engine refused the reset: there is no state, and `error` says why.
  bool failed_at_reset() const { return step == 0 && has_ended(); }
};

struct RecorderOptions {
  std::uint32_t environment = 0;            ///< index within its server
  std::optional<std::uint64_t> first_seed;  ///< of the first reset where that brings none
  bool keeps_actions = true;                ///< without them there is no record
};

/// Keeps an `EpisodeState` in step with the environment that it wraps, whoever resets and steps it,
/// and remembers the actions, by which the episode can be repeated.
class WALKER_SIM_EXPORT EpisodeRecorder final : public Environment {
 public:
  /// An endless episode must not fill the memory: its record is given up (at 6 joints, 48 MB).
  static constexpr std::uint32_t kMostRecordedSteps = walker::kMostRecordedSteps;

  explicit EpisodeRecorder(std::unique_ptr<Environment> wrapped, RecorderOptions options = {});

  const EpisodeState& state() const { return state_; }
  bool has_episode() const { return state_.episode != 0; }
  /// Of the present episode, step x action; none of one that is too long for a record.
  const std::vector<double>& actions() const { return actions_; }

  // The environment as whoever holds it drives it. Where the engine fails at a reset, the episode
  // has ended with that (`EpisodeState::failed_at_reset`).

  void reset(std::optional<std::uint64_t> seed);
  /// Begins the episode that began from this state of the generator.
  /// @param seed that the state came from, for the account; none: it was a continued one
  /// @throws std::invalid_argument for a state that no generator has; then nothing has changed
  void begin(const GeneratorState& generator_state, std::optional<std::uint64_t> seed);
  /// @throws InvalidAction, ResetNeeded; then nothing has changed
  void step(const double* action, std::size_t size);
  void step(const std::vector<double>& action) { step(action.data(), action.size()); }

  /// Measurements of the present state, made at most once per state.
  /// @throws ResetNeeded where there is none
  const Sensors& sensors();
  /// Surroundings of the present episode. @throws as `sensors`
  const Scene& scene();
  /// Copies both, for a picture. @throws as `sensors`
  void capture(StateCapture& captured) { walker::capture(*this, state_.step, captured); }

  // Records.

  /// The present episode up to now.
  /// @throws std::logic_error when there is none, when it cannot be repeated, or when it is longer
  ///         than `kMostRecordedSteps`
  EpisodeRecord record() const;
  /// Begins the episode that was recorded; `repeat` goes on in it.
  /// @throws std::invalid_argument naming what keeps this environment from repeating it
  void begin(const EpisodeRecord& record);
  /// Repeats steps, one at least, up to the last of these or about this time.
  /// @param actions of the whole episode, step x action
  /// @return whether it has come to the last one
  /// @throws std::invalid_argument naming a step that is refused
  bool repeat(const std::vector<double>& actions, std::chrono::steady_clock::time_point until =
                                                      std::chrono::steady_clock::time_point::max());
  /// The same of a record. @throws also where its sum of rewards comes out differently here
  bool repeat(const EpisodeRecord& record, std::chrono::steady_clock::time_point until);
  /// Appends the state of the environment, as `Environment::save_state`.
  void save_state(std::vector<std::byte>& state);
  /// Goes on from it, as `Environment::load_state`. Of an episode that was begun elsewhere there is
  /// no record: neither its beginning nor its first actions are known.
  void load_state(const std::byte* state, std::size_t size);
  /// As `Environment::set_coordinates`. There is no record of the episode any more.
  void set_coordinates(const std::vector<double>& position, const std::vector<double>& velocity);
  /// The other's episode takes the place of this one, which the other gets: the next in the count,
  /// where it has begun.
  void take_over(EpisodeRecorder& other);

  // The environment as a pool drives it.

  const Specification& specification() const override { return wrapped_->specification(); }
  void reset(std::optional<std::uint64_t> seed, Result& result) override;
  void step(const double* action, std::size_t size, Result& result) override;
  void step_together(StepCall* const* calls, std::size_t count, std::size_t size) noexcept override;
  std::size_t group_size() const override { return wrapped_->group_size(); }
  void sense(Sensors& sensors) override { wrapped_->sense(sensors); }
  void scene(Scene& scene) const override { wrapped_->scene(scene); }
  GeneratorState generator_state() const override { return wrapped_->generator_state(); }
  void set_generator_state(const GeneratorState& state) override {
    wrapped_->set_generator_state(state);
  }
  bool can_save_state() const override { return wrapped_->can_save_state(); }
  void save_state(const Result& last, std::vector<std::byte>& state) const override {
    wrapped_->save_state(last, state);
  }
  Progress load_state(const std::byte* state, std::size_t size, Result* last) override;
  void set_coordinates(const std::vector<double>& position, const std::vector<double>& velocity,
                       Result& result) override;
  std::optional<bool> is_healthy() const override { return wrapped_->is_healthy(); }

 private:
  Result own_result();
  void start(std::optional<std::uint64_t> seed, Result& result);
  void start(const GeneratorState& generator_state, std::optional<std::uint64_t> seed,
             Result& result);
  void take_step(const double* action, std::size_t size, const Result& result);
  void take(const Result& result);

  std::unique_ptr<Environment> wrapped_;
  RecorderOptions options_;
  EpisodeState state_;
  std::vector<double> actions_;
  bool was_loaded_ = false;  // or set to coordinates, so that the actions alone do not lead there
  StepCall wrapped_call_;    // kept, for it would be cleared anew on each step
  Sensors sensors_;
  Scene scene_;
  bool sensors_are_fresh_ = false;
};

}  // namespace walker
