#include <pybind11/stl.h>

#include <cstddef>
#include <cstring>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/engine_release.h"
#include "core/episode_recorder.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "python/conversions.h"
#include "walker_sim/parameters.h"
#include "walker_sim/registry.h"
#include "walker_sim/renderer.h"

namespace walker::python {
namespace py = pybind11;
namespace {

std::string engine_of(const Specification& specification) {
  return specification.engine + " " + engine_release(specification.engine_version);
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

/// An environment that knows how its episode came about, so that it can be copied and stored. One
/// thread at a time is let in; the others wait without the interpreter's lock.
class RecordedEnvironment {
 public:
  /// @throws ValueError, TypeError as `make`
  RecordedEnvironment(std::string id, const py::dict& parameters)
      : id_(std::move(id)),
        parameters_(to_parameters(parameters)),
        recorder_(make(id_, parameters_)) {}

  py::dict specification() const { return to_dict(recorder_.specification()); }

  /// Begins an episode from a generator's state.
  /// @return the generator's state afterwards
  GeneratorState reset(const GeneratorState& generator_state, py::handle observation,
                       py::handle info) {
    const EpisodeState& state = recorder_.state();
    Output observations(observation, "observation", state.observation.size());
    Output infos(info, "info", state.info.size());
    const Unlocked unlocked(mutex_);
    begin(generator_state);
    observations.take(state.observation.data());
    infos.take(state.info.data());
    return recorder_.generator_state();
  }

  /// @return reward, terminated, truncated, and the engine's error or an empty text
  std::tuple<double, bool, bool, std::string> step(py::handle action, py::handle observation,
                                                   py::handle info) {
    const EpisodeState& state = recorder_.state();
    const Input actions(action, "action");
    Output observations(observation, "observation", state.observation.size());
    Output infos(info, "info", state.info.size());
    const Unlocked unlocked(mutex_);
    recorder_.step(actions.data(), actions.size());
    observations.take(state.observation.data());
    infos.take(state.info.data());
    return {state.reward, state.terminated, state.truncated, state.error};
  }

  /// What a picture is drawn from.
  /// @throws ResetNeeded where there is no state to be seen
  StateCapture capture() {
    StateCapture captured;
    const Unlocked unlocked(mutex_);
    recorder_.capture(captured);
    return captured;
  }

  /// For pickle and copy: how to come to the present state.
  /// @throws ValueError where the episode depends on those before it, or is too long
  py::tuple state() const {
    EpisodeState state;
    std::vector<double> actions;
    {
      const Unlocked unlocked(mutex_);
      state = recorder_.state();
      actions = recorder_.actions();
    }
    const Specification& specification = recorder_.specification();
    const bool has_begun = state.episode != 0 && !state.failed_at_reset();
    if (has_begun && !specification.episodes_are_independent) {
      throw py::value_error(
          "with reuse_world an episode depends on those before it, so it cannot be copied or "
          "stored; only an environment before its first reset can");
    }
    if (state.step > EpisodeRecorder::kMostRecordedSteps) {
      throw py::value_error("an episode of more than " +
                            std::to_string(EpisodeRecorder::kMostRecordedSteps) +
                            " steps cannot be copied or stored");
    }
    return py::make_tuple(version(), engine_of(specification), id_, parameters_, has_begun,
                          state.generator_state, to_bytes(actions), to_bytes(state.observation));
  }

  /// @throws ValueError where another version stored it, or the episode comes out differently
  static std::unique_ptr<RecordedEnvironment> from_state(const py::tuple& state) {
    constexpr std::size_t kFields = 8;
    if (state.size() != kFields) throw py::value_error("this is no stored environment");
    auto environment = std::make_unique<RecordedEnvironment>(state[2].cast<std::string>(),
                                                             state[3].cast<py::dict>());
    const std::string engine = engine_of(environment->recorder_.specification());
    if (state[0].cast<std::string>() != version() || state[1].cast<std::string>() != engine) {
      throw py::value_error("stored by walker_sim " + state[0].cast<std::string>() + " on " +
                            state[1].cast<std::string>() + "; this is walker_sim " + version() +
                            " on " + engine);
    }
    if (!state[4].cast<bool>()) return environment;
    const auto generator_state = state[5].cast<GeneratorState>();
    const std::vector<double> actions = from_bytes(state[6]);
    const std::vector<double> observation = from_bytes(state[7]);
    {
      const py::gil_scoped_release release;
      environment->begin(generator_state);
      environment->recorder_.repeat(actions);
    }
    if (!have_equal_bits(environment->recorder_.state().observation, observation)) {
      throw py::value_error(
          "the stored episode of " + environment->id_ +
          " comes out differently here; has a file changed that its parameters name?");
    }
    return environment;
  }

 private:
  /// @throws std::runtime_error with the engine's words where it fails
  void begin(const GeneratorState& generator_state) {
    recorder_.begin(generator_state, std::nullopt);
    if (recorder_.state().failed_at_reset()) throw std::runtime_error(recorder_.state().error);
  }

  std::string id_;
  Parameters parameters_;
  mutable std::mutex mutex_;
  EpisodeRecorder recorder_;
};

}  // namespace

void bind_environment(py::module& module) {
  py::class_<RecordedEnvironment>(module, "Environment")
      .def(py::init<std::string, const py::dict&>(), py::arg("id"), py::arg("parameters"))
      .def_property_readonly("specification", &RecordedEnvironment::specification)
      .def("reset", &RecordedEnvironment::reset)
      .def("step", &RecordedEnvironment::step)
      .def("capture", &RecordedEnvironment::capture)
      .def(py::pickle([](const RecordedEnvironment& environment) { return environment.state(); },
                      &RecordedEnvironment::from_state));
}

}  // namespace walker::python
