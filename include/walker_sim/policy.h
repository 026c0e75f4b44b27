// Runs policies that `python3 -m walker_sim train` has trained, without Python.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "walker_sim/agent.h"
#include "walker_sim/export.h"
#include "walker_sim/specification.h"

namespace walker {

class Forward;
class PolicyInput;

/// A file is not a policy or does not fit the environment. The message names the file and the
/// reason.
struct WALKER_SIM_EXPORT PolicyError : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

/// How much of an episode a policy's input has.
struct PolicyHistory {
  std::size_t observations = 1;  ///< the latest ones, with the present one
  std::size_t actions = 0;       ///< the latest ones
};

/// A multilayer perceptron in single precision. Its input is the observation or, if the policy has
/// a history, that of a `PolicyInput`. It is normalised first, and the output is limited to the
/// action's bounds. docs/policies.md documents the file format.
class WALKER_SIM_EXPORT Policy {
 public:
  /// Reads a safetensors file.
  /// @throws PolicyError if the file is unreadable, truncated or not a policy
  explicit Policy(const std::string& file);
  /// Reads the content of a safetensors file; `name` replaces the file name in error messages.
  /// @throws PolicyError likewise
  Policy(const std::string& name, const std::vector<char>& content);
  Policy(Policy&&) noexcept;
  Policy& operator=(Policy&&) noexcept;
  ~Policy();

  /// Id of the environment that the policy was trained on, e.g. "Walker2d-v5".
  const std::string& id() const;

  /// Remaining entries of the file's header: algorithm, steps, seed, settings (a SHA-256).
  const std::map<std::string, std::string>& notes() const;

  std::size_t observation_size() const;
  std::size_t action_size() const;
  const PolicyHistory& history() const;

  /// Size of the network's input: that of as many observations and actions as `history()` has.
  std::size_t input_size() const;

  /// Checks that the environment's observation size, action size and action bounds are the
  /// policy's. Id and parameters may differ, so that a policy can be tried on other environments.
  /// @throws PolicyError
  void check(const Specification& specification) const;

  /// Returns each layer's weight, row-major with one row per output, and its bias.
  std::vector<float> parameters() const;

  /// Returns a policy that differs in the layers' parameters only.
  /// @param parameters in the order of `parameters()`
  /// @throws std::invalid_argument if their number is wrong
  Policy with_parameters(const std::vector<float>& parameters) const;

  /// Computes the deterministic action. Allocates no memory. Not thread-safe.
  /// @param observation `observation_size()` values
  /// @param action caller's buffer, `action_size()` values: single precision, within the bounds;
  ///               NaN if the layers overflow single precision
  /// @throws PolicyError if the policy has a history
  void act(const double* observation, double* action);

  /// Computes several actions at once: faster, and bitwise equal to single calls.
  /// @param observations, actions `rows` rows
  /// @throws PolicyError likewise
  void act(const double* observations, std::size_t rows, double* actions);

  /// Computes the action for the next observation of an episode; adds both to `input`.
  /// @param input made for this policy, `reset` when the episode began
  /// @throws PolicyError if it was made for a policy with another history or other sizes
  void act(const double* observation, PolicyInput& input, double* action);

  /// @param inputs, actions `rows` rows; `input_size()` values each, as `PolicyInput` has them
  void act_on_inputs(const double* inputs, std::size_t rows, double* actions);

 private:
  struct State;
  friend const Forward& forward_of(const Policy& policy);  // src/policy/network.h

  explicit Policy(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// What a policy acts on in an episode: its latest observations, then the actions that it gave to
/// them, each from the oldest to the newest. What was before the first step is zero. Each walker
/// needs its own.
class WALKER_SIM_EXPORT PolicyInput {
 public:
  explicit PolicyInput(const Policy& policy);

  std::size_t size() const { return values_.size(); }

  /// Begins an episode.
  void reset();

  /// Adds an observation. @return the input, `Policy::input_size()` values until the next call
  const double* add_observation(const double* observation);

  /// Adds the action that the policy gave to the latest observation.
  void add_action(const double* action);

 private:
  std::size_t observation_size_;
  std::size_t action_size_;
  std::size_t num_observed_;  // values of all observations
  std::vector<double> values_;
};

/// @throws PolicyError if the file is not a policy or does not fit the environment
WALKER_SIM_EXPORT std::unique_ptr<Agent> make_policy_agent(const std::string& file,
                                                           const Specification& specification);

}  // namespace walker
