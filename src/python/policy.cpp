#include <pybind11/stl.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "base/interruption.h"
#include "python/bindings.h"
#include "python/conversions.h"
#include "walker_sim/agent.h"
#include "walker_sim/episode_player.h"
#include "walker_sim/policy.h"
#include "walker_sim/registry.h"

namespace walker::python {
namespace py = pybind11;
namespace {

/// The agent "heuristic" or "random". It has state, so each walker needs its own.
class AgentBinding {
 public:
  AgentBinding(const std::string& name, const std::string& id, const py::dict& parameters,
               std::uint64_t seed)
      : specification_(make(id, to_parameters(parameters))->specification()),
        agent_(make_agent(name, specification_, seed)),
        observation_(specification_.observation_size()) {}

  void act(py::handle observation, py::handle action) {
    const Input input(observation, "observation", observation_.size());
    Output output(action, "action", specification_.action_size());
    observation_.assign(input.data(), input.data() + input.size());
    output.write(agent_->act(observation_).data());
  }

 private:
  Specification specification_;
  std::unique_ptr<Agent> agent_;
  std::vector<double> observation_;
};

/// A trained network. Thread-safe: a mutex serialises calls of `act`.
class PolicyBinding : public Policy {
 public:
  explicit PolicyBinding(Policy policy) : Policy(std::move(policy)) {}

  static std::unique_ptr<PolicyBinding> from_bytes(const std::string& name,
                                                   const py::bytes& bytes) {
    const std::string content(bytes);
    return std::make_unique<PolicyBinding>(Policy(name, {content.begin(), content.end()}));
  }

  py::dict notes_dict() const {
    py::dict dict;
    for (const auto& [name, text] : Policy::notes()) dict[to_str(name)] = to_str(text);
    return dict;
  }

  void check(const std::string& id, const py::dict& parameters) const {
    Policy::check(make(id, to_parameters(parameters))->specification());
  }

  std::unique_ptr<PolicyBinding> with_parameters(py::handle given) const {
    const Input input(given, "parameters");
    return std::make_unique<PolicyBinding>(
        Policy::with_parameters({input.data(), input.data() + input.size()}));
  }

  /// Acts on the next observation of the episode of `given`.
  void act_next(PolicyInput& given, py::handle observation, py::handle action) {
    const Input input(observation, "observation", observation_size());
    Output output(action, "action", action_size());
    const GilFreeLock lock(mutex_);
    actions_.resize(output.size());
    Policy::act(input.data(), given, actions_.data());
    output.write(actions_.data());
  }

  py::tuple history_tuple() const {
    return py::make_tuple(Policy::history().observations, Policy::history().actions);
  }

  /// @param observations rows of `input_size()` values: observations, or inputs of policies that
  ///                     remember
  /// @param actions      receives a row of `action_size()` values for each
  void act(py::handle observations, py::handle actions) {
    const Input input(observations, "observations");
    const std::size_t rows = input.size() / input_size();
    if (input.size() != rows * input_size()) {
      throw py::value_error("observations has " + std::to_string(input.size()) +
                            " values; must have " + std::to_string(input_size()) + " a row");
    }
    Output output(actions, "actions", rows * action_size());
    const GilFreeLock lock(mutex_);
    actions_.resize(output.size());
    constexpr std::size_t kRowsPerCheck = 16;
    for (std::size_t row = 0; row < rows; row += kRowsPerCheck) {
      check_step_interruption();
      act_on_inputs(input.data() + row * input_size(), std::min(kRowsPerCheck, rows - row),
                    actions_.data() + row * action_size());
    }
    output.write(actions_.data());
  }

 private:
  CallMutex mutex_;
  std::vector<double> actions_;  // of the last call; keeps its memory
};

/// Plays episodes of policies. Thread-safe: a mutex serialises the calls.
class EpisodePlayerBinding {
 public:
  EpisodePlayerBinding(std::string id, const py::dict& parameters, std::size_t num_threads,
                       std::size_t num_envs, bool sums_observations)
      : player_([id = std::move(id), given = to_parameters(parameters)] { return make(id, given); },
                EpisodePlayerOptions{num_threads, num_envs, sums_observations}) {}

  py::dict specification() const { return to_dict(player_.specification()); }
  std::size_t num_envs() const { return player_.options().num_envs; }

  /// @param policies list of Policy
  /// @param worlds   as for Pool.set_world
  /// @param jobs     tuples of the index of a policy, a seed and the index of a world
  /// @param receive  called with the index of a job and the fields of PlayedEpisode except the
  /// end's reason
  void play(const std::vector<const PolicyBinding*>& policies, const py::sequence& worlds,
            const std::vector<std::tuple<std::size_t, std::uint64_t, std::size_t>>& jobs,
            const py::function& receive) {
    const std::vector<const Policy*> networks(policies.begin(), policies.end());
    const std::vector<World> ranges = to_worlds(worlds);
    std::vector<EpisodeJob> all;
    all.reserve(jobs.size());
    for (const auto& [policy, seed, world] : jobs) all.push_back({policy, seed, world});
    const GilFreeLock lock(mutex_);
    player_.play(networks, ranges, all, [&](std::size_t job, const PlayedEpisode& played) {
      const GilHold hold;
      receive(job, played.episode_return, played.length, played.terminated, played.truncated,
              played.reward, to_str(played.error), played.info, to_drawn(played.world),
              played.observation_sums, played.observation_squares);
    });
  }

 private:
  CallMutex mutex_;
  EpisodePlayer player_;
};

}  // namespace

void bind_policy(py::module& module) {
  py::class_<AgentBinding>(module, "Agent")
      .def(py::init<const std::string&, const std::string&, const py::dict&, std::uint64_t>())
      .def("act", &AgentBinding::act);
  py::class_<PolicyBinding>(module, "Policy")
      .def(py::init(
          [](const std::string& file) { return std::make_unique<PolicyBinding>(Policy(file)); }))
      .def_static("from_bytes", &PolicyBinding::from_bytes)
      .def_property_readonly("id", [](const PolicyBinding& self) { return to_str(self.id()); })
      .def_property_readonly("notes", &PolicyBinding::notes_dict)
      .def_property_readonly("observation_size", &PolicyBinding::observation_size)
      .def_property_readonly("action_size", &PolicyBinding::action_size)
      .def_property_readonly("input_size", &PolicyBinding::input_size)
      .def_property_readonly("history", &PolicyBinding::history_tuple)
      .def("check", &PolicyBinding::check)
      .def_property_readonly("parameters", &PolicyBinding::parameters)
      .def("with_parameters", &PolicyBinding::with_parameters)
      .def("act", &PolicyBinding::act)
      .def("act_next", &PolicyBinding::act_next);
  py::class_<PolicyInput>(module, "PolicyInput").def(py::init<const PolicyBinding&>());
  py::class_<EpisodePlayerBinding>(module, "EpisodePlayer")
      .def(py::init<std::string, const py::dict&, std::size_t, std::size_t, bool>())
      .def_property_readonly("specification", &EpisodePlayerBinding::specification)
      .def_property_readonly("num_envs", &EpisodePlayerBinding::num_envs)
      .def("play", &EpisodePlayerBinding::play);
}

}  // namespace walker::python
