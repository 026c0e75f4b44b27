// The rules of an episode: which steps are allowed, and when the time is over.
#pragma once

#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "episode/state_header.h"
#include "walker_sim/environment.h"

namespace walker {

/// Wraps an environment as Gymnasium's TimeLimit and OrderEnforcing do, and refuses malformed
/// actions, so that each environment may rely on well-formed calls.
///
/// The time limit sets `truncated` on step `max_episode_steps` (0: never), also where that step
/// terminates. The wrapped environment's specification must carry the same limit.
///
/// An exception of the engine ends the episode: `terminated` with `error`, reward 0, no info, the
/// observation left as it was; then only a reset is allowed. So it is after a reset that throws.
class EpisodeRules : public Environment {
 public:
  explicit EpisodeRules(std::unique_ptr<Environment> wrapped);

  const Specification& specification() const override { return wrapped_->specification(); }
  void reset(std::optional<std::uint64_t> seed, Result& result) override;
  void step(const double* action, std::size_t size, Result& result) override;
  /// The calls that the rules allow reach the wrapped environments together.
  void step_together(StepCall* const* calls, std::size_t count, std::size_t size) noexcept override;
  std::size_t group_size() const override { return wrapped_->group_size(); }
  void sense(Sensors& sensors) override;
  void scene(Scene& scene) const override;
  GeneratorState generator_state() const override { return wrapped_->generator_state(); }
  void set_generator_state(const GeneratorState& state) override {
    wrapped_->set_generator_state(state);
  }
  bool can_save_state() const override { return wrapped_->can_save_state(); }
  void save_state(const Result& last, std::vector<std::byte>& state) const override;
  Progress load_state(const std::byte* state, std::size_t size, Result* last) override;
  void set_coordinates(const std::vector<double>& position, const std::vector<double>& velocity,
                       Result& result) override;
  std::optional<bool> is_healthy() const override;

 private:
  enum class Phase : std::uint8_t { before_reset, running, ended, failed };

  /// What a state says of the rules, and of what came last.
  struct Saved;

  const StateOrigin& origin() const;
  void check_phase() const;
  void conclude(Result& result);
  void need_state_for(const char* call) const;
  void fail(const std::exception_ptr& thrown, Result& result);

  std::unique_ptr<Environment> wrapped_;
  Phase phase_ = Phase::before_reset;
  std::uint32_t steps_ = 0;
  double episode_return_ = 0;
  std::string time_limit_reason_;
  std::string error_;                          // of the engine; `Result::error` points here
  std::string loaded_end_reason_;              // `Result::end_reason` points here after a load
  mutable std::optional<StateOrigin> origin_;  // of states; none before the first
  StepCall wrapped_call_;                      // kept, for it would be cleared anew on each step
};

}  // namespace walker
