#include "python/client.h"

#include <pybind11/stl.h>

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "python/arrays.h"
#include "python/conversions.h"
#include "python/unlocked.h"
#include "walker_sim/client.h"

namespace walker::python {
namespace py = pybind11;
namespace {

ClientOptions make_options(std::string server, std::string master_uri, double timeout) {
  ClientOptions options;
  options.server = std::move(server);
  options.master_uri = std::move(master_uri);
  options.timeout = timeout;
  return options;
}

/// Copies where the answer is as large as the caller's array; who has connected knows the size.
/// @throws ConnectionError
template <typename Values, typename Destination>
void take(const Values& values, const char* what, Destination& destination) {
  if (values.size() != destination.size()) {
    throw ConnectionError("the server answers with " + std::to_string(values.size()) +
                          " values of " + what + " where " + std::to_string(destination.size()) +
                          " were expected; has it been started again with other parameters?");
  }
  destination.take(values.data());
}

/// A server's calls, filling arrays of the caller's. One thread at a time is let in.
class RemoteWalkers {
 public:
  RemoteWalkers(std::string server, std::string master_uri, double timeout)
      : client_(make_options(std::move(server), std::move(master_uri), timeout)) {}

  py::dict specification() {
    ServerSpecification specification;
    {
      const Unlocked unlocked(mutex_);
      specification = client_.specification();
    }
    return to_dict(specification);
  }

  void reset(const py::object& seed, py::handle observation, py::handle info) {
    const auto number = to_seed(seed);
    Output observations(observation, "observation");
    Output infos(info, "info");
    const Unlocked unlocked(mutex_);
    client_.reset(number, transition_);
    take(transition_.observation, "observation", observations);
    take(transition_.info, "info", infos);
  }

  /// @return as Environment.step
  py::tuple step(py::handle action, py::handle observation, py::handle info) {
    const Input actions(action, "action");
    Output observations(observation, "observation");
    Output infos(info, "info");
    {
      const Unlocked unlocked(mutex_);
      client_.step(actions.data(), actions.size(), transition_);
      take(transition_.observation, "observation", observations);
      take(transition_.info, "info", infos);
    }
    return py::make_tuple(transition_.reward, transition_.terminated, transition_.truncated,
                          transition_.error);
  }

  /// Rows in the order of `environments`; empty: of all.
  void reset_batch(const std::vector<std::uint32_t>& environments, const py::sequence& seeds,
                   py::handle observations, py::handle info) {
    const auto numbers = to_seeds(seeds);
    Output observations_output(observations, "observations");
    Output info_output(info, "info");
    const Unlocked unlocked(mutex_);
    client_.reset_batch(environments, numbers, reset_);
    take(reset_.observations, "observations", observations_output);
    take(reset_.info, "info", info_output);
  }

  void step_batch(py::handle actions, py::handle observations, py::handle rewards,
                  py::handle terminated, py::handle truncated, py::handle info) {
    const Input input(actions, "actions");
    Output observations_output(observations, "observations");
    Output rewards_output(rewards, "rewards");
    FlagOutput terminated_output(terminated, "terminated");
    FlagOutput truncated_output(truncated, "truncated");
    Output info_output(info, "info");
    const Unlocked unlocked(mutex_);
    client_.step_batch(input.data(), input.size(), batch_);
    take(batch_.observations, "observations", observations_output);
    take(batch_.rewards, "rewards", rewards_output);
    take(batch_.terminated, "terminated", terminated_output);
    take(batch_.truncated, "truncated", truncated_output);
    take(batch_.info, "info", info_output);
  }

  /// same_step: environments whose episodes ended in the last `step_batch`.
  std::vector<std::uint32_t> final_environments() const { return batch_.final_environments; }

  /// A row for each of `final_environments`.
  void final_rows(py::handle observations, py::handle info) {
    Output observations_output(observations, "observations");
    Output info_output(info, "info");
    take(batch_.final_observations, "final_observations", observations_output);
    take(batch_.final_info, "final_info", info_output);
  }

 private:
  Client client_;
  std::mutex mutex_;
  Transition transition_;
  BatchReset reset_;
  BatchTransition batch_;
};

}  // namespace

void bind_client(py::module& module) {
  const auto observation = py::arg("observation");
  const auto observations = py::arg("observations");
  const auto info = py::arg("info");
  py::class_<RemoteWalkers>(module, "Client")
      .def(py::init<std::string, std::string, double>(), py::arg("server"), py::arg("master_uri"),
           py::arg("timeout"))
      .def("specification", &RemoteWalkers::specification)
      .def("reset", &RemoteWalkers::reset, py::arg("seed"), observation, info)
      .def("step", &RemoteWalkers::step, py::arg("action"), observation, info)
      .def("reset_batch", &RemoteWalkers::reset_batch, py::arg("environments"), py::arg("seeds"),
           observations, info)
      .def("step_batch", &RemoteWalkers::step_batch, py::arg("actions"), observations,
           py::arg("rewards"), py::arg("terminated"), py::arg("truncated"), info)
      .def("final_environments", &RemoteWalkers::final_environments)
      .def("final_rows", &RemoteWalkers::final_rows, observations, info);
}

}  // namespace walker::python
