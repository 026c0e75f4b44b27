// A trained network that acts: what `python3 -m walker_sim train` leaves, read and run without
// Python.
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

/// A file is no policy, or none for this environment. The message names the file and the reason.
struct WALKER_SIM_EXPORT PolicyError : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

/// Fully connected layers in single precision between a normalisation of observations and the
/// action's limits. docs/policies.md documents the file.
class WALKER_SIM_EXPORT Policy {
 public:
  /// Reads a safetensors file.
  /// @throws PolicyError for a file that cannot be read, is cut short, or holds something else
  explicit Policy(const std::string& file);
  /// Reads the content of such a file.
  /// @param name stands in errors where a file's would
  /// @throws PolicyError likewise
  Policy(const std::string& name, const std::vector<char>& content);
  Policy(Policy&&) noexcept;
  Policy& operator=(Policy&&) noexcept;
  ~Policy();

  /// Of the environment that it was trained on, e.g. "Walker2d-v5".
  const std::string& id() const;

  /// What else its header says, by name: algorithm, steps, seed, settings (their SHA-256).
  const std::map<std::string, std::string>& notes() const;

  std::size_t observation_size() const;
  std::size_t action_size() const;

  /// Refuses an environment with other observations, actions or limits of actions. Another id with
  /// the same ones, or other parameters, is no reason: a policy may be tried elsewhere.
  /// @throws PolicyError
  void check(const Specification& specification) const;

  /// The deterministic action. Allocates nothing; not for two threads at once.
  /// @param observation `observation_size()` values
  /// @param action caller's, `action_size()` values, single precision, within the limits
  void act(const double* observation, double* action);

  /// The same for several observations at once, faster; to the bit as for each alone.
  /// @param observations, actions `rows` rows of these
  void act(const double* observations, std::size_t rows, double* actions);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The agent "policy".
/// @throws PolicyError for a broken file, or one that does not fit the environment
WALKER_SIM_EXPORT std::unique_ptr<Agent> make_policy_agent(const std::string& file,
                                                           const Specification& specification);

}  // namespace walker
