#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "python/bindings.h"
#include "python/conversions.h"
#include "walker_sim/agent.h"
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
class PolicyBinding {
 public:
  explicit PolicyBinding(Policy policy) : policy_(std::move(policy)) {}

  py::str id() const { return to_str(policy_.id()); }
  std::size_t observation_size() const { return policy_.observation_size(); }
  std::size_t action_size() const { return policy_.action_size(); }

  py::dict notes() const {
    py::dict dict;
    for (const auto& [name, text] : policy_.notes()) dict[to_str(name)] = to_str(text);
    return dict;
  }

  void check(const std::string& id, const py::dict& parameters) const {
    policy_.check(make(id, to_parameters(parameters))->specification());
  }

  /// @param observations rows of `observation_size()` values
  /// @param actions      receives a row of `action_size()` values for each
  void act(py::handle observations, py::handle actions) {
    const Input input(observations, "observations");
    const std::size_t rows = input.size() / observation_size();
    if (input.size() != rows * observation_size()) {
      throw py::value_error("observations has " + std::to_string(input.size()) +
                            " values; must have " + std::to_string(observation_size()) + " a row");
    }
    Output output(actions, "actions", rows * action_size());
    const GilFreeLock lock(mutex_);
    actions_.resize(output.size());
    policy_.act(input.data(), rows, actions_.data());
    output.write(actions_.data());
  }

 private:
  std::mutex mutex_;
  Policy policy_;
  std::vector<double> actions_;  // of the last call; keeps its memory
};

std::unique_ptr<PolicyBinding> read_bytes(const std::string& name, const py::bytes& content) {
  const std::string bytes = content;
  return std::make_unique<PolicyBinding>(Policy(name, {bytes.begin(), bytes.end()}));
}

}  // namespace

void bind_policy(py::module& module) {
  py::class_<AgentBinding>(module, "Agent")
      .def(py::init<const std::string&, const std::string&, const py::dict&, std::uint64_t>(),
           py::arg("name"), py::arg("id"), py::arg("parameters"), py::arg("seed"))
      .def("act", &AgentBinding::act);
  py::class_<PolicyBinding>(module, "Policy")
      .def(py::init([](const std::string& file) {
             return std::make_unique<PolicyBinding>(Policy(file));
           }),
           py::arg("file"))
      .def_static("from_bytes", &read_bytes, py::arg("name"), py::arg("content"))
      .def_property_readonly("id", &PolicyBinding::id)
      .def_property_readonly("notes", &PolicyBinding::notes)
      .def_property_readonly("observation_size", &PolicyBinding::observation_size)
      .def_property_readonly("action_size", &PolicyBinding::action_size)
      .def("check", &PolicyBinding::check, py::arg("id"), py::arg("parameters"))
      .def("act", &PolicyBinding::act, py::arg("observations"), py::arg("actions"));
}

}  // namespace walker::python
