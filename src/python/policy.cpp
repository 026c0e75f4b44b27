#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "python/arrays.h"
#include "python/bindings.h"
#include "python/conversions.h"
#include "walker_sim/agent.h"
#include "walker_sim/policy.h"
#include "walker_sim/registry.h"

namespace walker::python {
namespace py = pybind11;
namespace {

/// A gait, random actions or a network's; one per walker, for it remembers its episode.
class AgentPolicy {
 public:
  AgentPolicy(const std::string& name, const std::string& id, const py::dict& parameters,
              std::uint64_t seed, const std::string& file)
      : specification_(make(id, to_parameters(parameters))->specification()),
        agent_(name == "policy" ? make_policy_agent(file, specification_)
                                : make_agent(name, specification_, seed)),
        observation_(specification_.observation_size()) {}

  void act(py::handle observation, py::handle action) {
    const Input input(observation, "observation", observation_.size());
    Output output(action, "action", specification_.action_size());
    observation_.assign(input.data(), input.data() + input.size());
    output.take(agent_->act(observation_).data());
  }

 private:
  Specification specification_;
  std::unique_ptr<Agent> agent_;
  std::vector<double> observation_;
};

}  // namespace

void bind_policy(py::module& module) {
  py::class_<AgentPolicy>(module, "Policy")
      .def(py::init<const std::string&, const std::string&, const py::dict&, std::uint64_t,
                    const std::string&>(),
           py::arg("name"), py::arg("id"), py::arg("parameters"), py::arg("seed"),
           py::arg("file") = "")
      .def("act", &AgentPolicy::act);
}

}  // namespace walker::python
