#include "python/environment.h"

#include <cstddef>
#include <utility>

#include "python/arrays.h"
#include "python/conversions.h"
#include "python/unlocked.h"
#include "walker_sim/registry.h"

namespace walker::python {
namespace py = pybind11;
namespace {

/// As for the server's records: then they are given up, for an episode may have no end.
constexpr std::size_t kMostRecordedSteps = 1000000;

}  // namespace

RecordedEnvironment::RecordedEnvironment(std::string id, const py::dict& parameters)
    : id_(std::move(id)),
      parameters_(to_parameters(parameters)),
      environment_(make(id_, parameters_)),
      observation_(environment_->specification().observation_size()),
      info_(environment_->specification().info_names.size()) {}

py::dict RecordedEnvironment::specification() const {
  return to_dict(environment_->specification());
}

py::tuple RecordedEnvironment::reset(const py::sequence& generator_state, py::handle observation,
                                     py::handle info) {
  const GeneratorState before = to_generator_state(generator_state);
  Output observations(observation, "observation", observation_.size());
  Output infos(info, "info", info_.size());
  GeneratorState after{};
  {
    const Unlocked unlocked(mutex_);
    environment_->set_generator_state(before);
    has_episode_ = false;  // stays so where the reset throws
    Result result;
    result.observation = observation_.data();
    result.info = info_.data();
    environment_->reset(std::nullopt, result);
    has_episode_ = true;
    is_too_long_ = false;
    generator_state_ = before;
    actions_.clear();
    after = environment_->generator_state();
    observations.take(observation_.data());
    infos.take(info_.data());
  }
  return to_tuple(after);
}

py::tuple RecordedEnvironment::step(py::handle action, py::handle observation, py::handle info) {
  const Input actions(action, "action");
  Output observations(observation, "observation", observation_.size());
  Output infos(info, "info", info_.size());
  Result result;
  std::string error;
  {
    const Unlocked unlocked(mutex_);
    result.observation = observation_.data();
    result.info = info_.data();
    environment_->step(actions.data(), actions.size(), result);
    if (actions_.size() >= kMostRecordedSteps * actions.size()) {
      is_too_long_ = true;
      actions_ = {};
    }
    if (!is_too_long_) {
      actions_.insert(actions_.end(), actions.data(), actions.data() + actions.size());
    }
    observations.take(observation_.data());
    infos.take(info_.data());
    error = result.error;
  }
  return py::make_tuple(result.reward, result.terminated, result.truncated, error);
}

py::tuple RecordedEnvironment::state() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const Specification& specification = environment_->specification();
  if (has_episode_ && !specification.episodes_are_independent) {
    throw py::value_error(
        "with reuse_world an episode depends on those before it, so it cannot be copied or stored; "
        "only an environment before its first reset can");
  }
  if (is_too_long_) {
    throw py::value_error("an episode of more than " + std::to_string(kMostRecordedSteps) +
                          " steps cannot be copied or stored");
  }
  const py::bytes actions(reinterpret_cast<const char*>(actions_.data()),
                          actions_.size() * sizeof(double));
  return py::make_tuple(version(), specification.engine + " " + specification.engine_version, id_,
                        to_dict(parameters_), has_episode_, to_tuple(generator_state_), actions);
}

std::unique_ptr<RecordedEnvironment> RecordedEnvironment::from_state(const py::tuple& state) {
  constexpr std::size_t kFields = 7;
  if (state.size() != kFields) throw py::value_error("this is no stored environment");
  auto environment = std::make_unique<RecordedEnvironment>(state[2].cast<std::string>(),
                                                           state[3].cast<py::dict>());
  const Specification& specification = environment->environment_->specification();
  const std::string engine = specification.engine + " " + specification.engine_version;
  if (state[0].cast<std::string>() != version() || state[1].cast<std::string>() != engine) {
    throw py::value_error("stored by walker_sim " + state[0].cast<std::string>() + " on " +
                          state[1].cast<std::string>() + "; this is walker_sim " + version() +
                          " on " + engine);
  }
  if (!state[4].cast<bool>()) return environment;
  environment->generator_state_ = to_generator_state(state[5].cast<py::sequence>());
  const auto bytes = state[6].cast<std::string>();
  std::vector<double> actions(bytes.size() / sizeof(double));
  bytes.copy(reinterpret_cast<char*>(actions.data()), actions.size() * sizeof(double));
  const py::gil_scoped_release release;
  environment->replay(actions);
  return environment;
}

void RecordedEnvironment::replay(const std::vector<double>& actions) {
  Result result;
  result.observation = observation_.data();
  result.info = info_.data();
  environment_->set_generator_state(generator_state_);
  environment_->reset(std::nullopt, result);
  has_episode_ = true;
  const std::size_t size = environment_->specification().action_size();
  for (std::size_t i = 0; i + size <= actions.size(); i += size) {
    environment_->step(actions.data() + i, size, result);
  }
  actions_ = actions;
}

void bind_environment(py::module& module) {
  py::class_<RecordedEnvironment>(module, "Environment")
      .def(py::init<std::string, const py::dict&>(), py::arg("id"), py::arg("parameters"))
      .def_property_readonly("specification", &RecordedEnvironment::specification)
      .def("reset", &RecordedEnvironment::reset, py::arg("generator_state"), py::arg("observation"),
           py::arg("info"))
      .def("step", &RecordedEnvironment::step, py::arg("action"), py::arg("observation"),
           py::arg("info"))
      .def(py::pickle(
          [](const RecordedEnvironment& environment) { return environment.state(); },
          [](const py::tuple& state) { return RecordedEnvironment::from_state(state); }));
}

}  // namespace walker::python
