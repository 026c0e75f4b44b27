// The environments of a pool: what each of them does next, and what came of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "walker_sim/pool.h"

namespace walker {

/// Each keeps its own results, so that one whose engine fails shows its last observation whichever
/// arrays the caller gives. Distinct environments may be stepped and reset in distinct threads at
/// the same time.
class PoolMembers {
 public:
  /// @throws std::invalid_argument when they are not of one kind
  PoolMembers(const std::function<std::unique_ptr<Environment>()>& make, std::size_t count,
              AutoresetMode mode);

  std::size_t count() const { return members_.size(); }
  const Specification& specification() const { return environment(0).specification(); }
  Environment& environment(std::size_t index) const { return *members_[index].environment; }
  /// At least 1.
  std::size_t group_size() const;

  /// @throws ResetNeeded naming the environment when it cannot be stepped
  void need_episode(std::size_t index) const;

  /// Begins an episode. Where the engine fails, it has ended with that.
  void reset(std::size_t index, std::optional<std::uint64_t> seed);

  /// The environment's next `step` is a reset, whether it has an episode or not.
  void request_reset(std::size_t index) { phases_[index] = Phase::ended; }

  /// Steps some environments together, or resets those whose reset is due. An engine that fails
  /// ends the episode of its own environment.
  /// @param indices `size` of them, at most Environment::kLargestGroup
  /// @param actions rows of all environments
  void step(const std::uint32_t* indices, std::size_t size, const double* actions);

  /// As the pool's.
  void save_state(std::size_t index, std::vector<std::byte>& state) const;
  void load_states(const std::vector<std::uint32_t>& indices,
                   const std::vector<std::vector<std::byte>>& states);

  /// Writes what an environment's last reset or step gave into a row of the caller's arrays.
  void write(std::size_t index, const Batch& batch, std::size_t row) const;

  const char* end_reason(std::size_t index) const { return members_[index].end_reason; }
  const char* error(std::size_t index) const { return members_[index].error; }
  const char* reset_error(std::size_t index) const { return members_[index].reset_error.c_str(); }

 private:
  enum class Phase : std::uint8_t { no_episode, running, ended };
  static constexpr std::size_t kCacheLine = 64;

  /// Neighbours may be in different threads' hands.
  struct alignas(kCacheLine) Member {
    std::unique_ptr<Environment> environment;
    Result result;            // of the last call, its buffers in the rows below
    StepCall call;            // kept, for all but the action stays the same
    std::string step_error;   // what a step threw past the rules
    std::string reset_error;  // empty unless the last reset failed
    // Of the last step or reset as the pool's caller sees it.
    double reward = 0;
    bool terminated = false;
    bool truncated = false;
    bool has_final = false;  // the final rows hold the episode that ended in it
    const char* end_reason = "";
    const char* error = "";
    std::uint32_t episode = 0;
    std::uint32_t steps = 0;
  };

  void load_state(std::size_t index, const std::vector<std::byte>& state);
  void begin_episode(std::size_t index, std::optional<std::uint64_t> seed);
  void conclude_step(std::size_t index);
  void take_outcome(std::size_t index);

  AutoresetMode mode_;
  std::size_t observation_size_ = 0;
  std::size_t num_infos_ = 0;
  std::vector<Member> members_;
  std::vector<Phase> phases_;  // apart and small, for they are looked through before each step
  std::vector<double> observations_;
  std::vector<double> info_;
  std::vector<double> final_observations_;  // same_step only
  std::vector<double> final_info_;
};

}  // namespace walker
