#include "python/environment.h"

#include <cstddef>
#include <cstring>
#include <optional>
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

std::string engine_of(const Specification& specification) {
  return specification.engine + " " + specification.engine_version;
}

py::bytes to_bytes(const std::vector<double>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(double)};
}

std::vector<double> from_bytes(const py::handle& object) {
  const auto bytes = object.cast<std::string>();
  std::vector<double> values(bytes.size() / sizeof(double));
  bytes.copy(reinterpret_cast<char*>(values.data()), values.size() * sizeof(double));
  return values;
}

/// NaN equals itself.
bool have_equal_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

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
    begin(before);
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
    advance(actions.data(), actions.size(), result);
    observations.take(observation_.data());
    infos.take(info_.data());
    error = result.error;
  }
  return py::make_tuple(result.reward, result.terminated, result.truncated, error);
}

void RecordedEnvironment::begin(const GeneratorState& generator_state) {
  environment_->set_generator_state(generator_state);
  episode_.has_begun = false;  // stays so where the reset throws
  Result result;
  result.observation = observation_.data();
  result.info = info_.data();
  environment_->reset(std::nullopt, result);
  episode_.has_begun = true;
  episode_.generator_state = generator_state;
  episode_.actions.clear();
  episode_.num_steps = 0;
  episode_.is_too_long = false;
}

void RecordedEnvironment::advance(const double* action, std::size_t size, Result& result) {
  result.observation = observation_.data();
  result.info = info_.data();
  environment_->step(action, size, result);
  ++episode_.num_steps;
  if (episode_.actions.size() >= kMostRecordedSteps * size) {
    episode_.is_too_long = true;
    episode_.actions = {};
  }
  if (!episode_.is_too_long) {
    episode_.actions.insert(episode_.actions.end(), action, action + size);
  }
}

Instant RecordedEnvironment::look() {
  Instant instant;
  const Unlocked unlocked(mutex_);
  walker::look(*environment_, episode_.num_steps, instant);
  return instant;
}

py::tuple RecordedEnvironment::state() const {
  Episode episode;
  std::vector<double> observation;
  {
    const Unlocked unlocked(mutex_);
    episode = episode_;
    observation = observation_;
  }
  const Specification& specification = environment_->specification();
  if (episode.has_begun && !specification.episodes_are_independent) {
    throw py::value_error(
        "with reuse_world an episode depends on those before it, so it cannot be copied or stored; "
        "only an environment before its first reset can");
  }
  if (episode.is_too_long) {
    throw py::value_error("an episode of more than " + std::to_string(kMostRecordedSteps) +
                          " steps cannot be copied or stored");
  }
  return py::make_tuple(version(), engine_of(specification), id_, to_dict(parameters_),
                        episode.has_begun, to_tuple(episode.generator_state),
                        to_bytes(episode.actions), to_bytes(observation));
}

std::unique_ptr<RecordedEnvironment> RecordedEnvironment::from_state(const py::tuple& state) {
  constexpr std::size_t kFields = 8;
  if (state.size() != kFields) throw py::value_error("this is no stored environment");
  auto environment = std::make_unique<RecordedEnvironment>(state[2].cast<std::string>(),
                                                           state[3].cast<py::dict>());
  const Specification& specification = environment->environment_->specification();
  const std::string engine = engine_of(specification);
  if (state[0].cast<std::string>() != version() || state[1].cast<std::string>() != engine) {
    throw py::value_error("stored by walker_sim " + state[0].cast<std::string>() + " on " +
                          state[1].cast<std::string>() + "; this is walker_sim " + version() +
                          " on " + engine);
  }
  if (!state[4].cast<bool>()) return environment;
  const GeneratorState generator_state = to_generator_state(state[5].cast<py::sequence>());
  const std::vector<double> actions = from_bytes(state[6]);
  const std::vector<double> observation = from_bytes(state[7]);
  {
    const py::gil_scoped_release release;
    environment->begin(generator_state);
    const std::size_t size = specification.action_size();
    Result result;
    for (std::size_t i = 0; i + size <= actions.size(); i += size) {
      environment->advance(actions.data() + i, size, result);
    }
  }
  if (!have_equal_bits(environment->observation_, observation)) {
    throw py::value_error(
        "the stored episode of " + environment->id_ +
        " comes out differently here; has a file changed that its parameters name?");
  }
  return environment;
}

void bind_environment(py::module& module) {
  py::class_<RecordedEnvironment>(module, "Environment")
      .def(py::init<std::string, const py::dict&>(), py::arg("id"), py::arg("parameters"))
      .def_property_readonly("specification", &RecordedEnvironment::specification)
      .def("reset", &RecordedEnvironment::reset, py::arg("generator_state"), py::arg("observation"),
           py::arg("info"))
      .def("step", &RecordedEnvironment::step, py::arg("action"), py::arg("observation"),
           py::arg("info"))
      .def("look", &RecordedEnvironment::look)
      .def(py::pickle(
          [](const RecordedEnvironment& environment) { return environment.state(); },
          [](const py::tuple& state) { return RecordedEnvironment::from_state(state); }));
}

}  // namespace walker::python
