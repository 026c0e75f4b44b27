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

#include "base/engine_release.h"
#include "base/limits.h"
#include "episode/episode.h"
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

template <typename Value>
py::bytes to_bytes(const std::vector<Value>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value)};
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

/// Records actions if these are the only way to copy and store an episode.
std::unique_ptr<Episode> make_recorded(const std::string& id, const Parameters& parameters) {
  std::unique_ptr<Episode> episode = make_episode(id, parameters);
  EpisodeOptions options;
  options.records_actions = !episode->can_save_state();
  episode->configure(options);
  return episode;
}

/// An environment that can be copied and stored. One thread at a time is let in; the others wait
/// without the interpreter's lock.
class RecordedEnvironment {
 public:
  /// @throws ValueError, TypeError as `make`
  RecordedEnvironment(std::string id, const py::dict& parameters)
      : id_(std::move(id)),
        parameters_(to_parameters(parameters)),
        episode_(make_recorded(id_, parameters_)) {}

  py::dict specification() const { return to_dict(episode_->specification()); }

  /// Begins an episode from a generator's state.
  /// @return the generator's state afterwards
  GeneratorState reset(const GeneratorState& generator_state, py::handle observation,
                       py::handle info) {
    const EpisodeState& state = episode_->state();
    Output observations(observation, "observation", state.observation.size());
    Output infos(info, "info", state.info.size());
    const Unlocked unlocked(mutex_);
    begin(generator_state);
    observations.take(state.observation.data());
    infos.take(state.info.data());
    return episode_->generator_state();
  }

  /// @return reward, terminated, truncated, and the engine's error or an empty text
  std::tuple<double, bool, bool, std::string> step(py::handle action, py::handle observation,
                                                   py::handle info) {
    const EpisodeState& state = episode_->state();
    const Input actions(action, "action");
    Output observations(observation, "observation", state.observation.size());
    Output infos(info, "info", state.info.size());
    const Unlocked unlocked(mutex_);
    episode_->step(actions.data(), actions.size());
    observations.take(state.observation.data());
    infos.take(state.info.data());
    return {state.reward, state.terminated, state.truncated, state.error};
  }

  /// What a picture is drawn from.
  /// @throws ResetNeeded where there is no state to be seen
  StateCapture capture() {
    StateCapture captured;
    const Unlocked unlocked(mutex_);
    episode_->capture(captured);
    return captured;
  }

  /// All that decides about what follows: bytes, or where the engine's state cannot be saved, how
  /// to come to the present one.
  /// @param generator_state that the next reset would be given; None: as it is here
  /// @throws ValueError where the episode depends on those before it, or is too long
  py::object get_state(const std::optional<GeneratorState>& generator_state) {
    std::vector<std::byte> bytes;
    {
      const Unlocked unlocked(mutex_);
      if (generator_state) episode_->set_generator_state(*generator_state);
      if (episode_->can_save_state()) episode_->save_state(bytes);
    }
    return bytes.empty() ? py::object(way_to_state()) : py::object(to_bytes(bytes));
  }

  /// @param state of an environment of the same id, parameters and engine
  /// @return the generator's state; all zero: there is none
  /// @throws ValueError naming what is wrong; then nothing has changed
  GeneratorState set_state(const py::object& state) {
    if (py::isinstance<py::tuple>(state) && !episode_->can_save_state()) {
      go_the_way(state);
    } else {
      const std::vector<std::byte> bytes = to_state_bytes(state);
      const Unlocked unlocked(mutex_);
      episode_->load_state(bytes.data(), bytes.size());
    }
    return episode_->generator_state();
  }

  /// As Environment::set_coordinates.
  void set_coordinates(py::handle position, py::handle velocity) {
    const Input positions(position, "qpos");
    const Input velocities(velocity, "qvel");
    const Unlocked unlocked(mutex_);
    episode_->set_coordinates({positions.data(), positions.data() + positions.size()},
                              {velocities.data(), velocities.data() + velocities.size()});
  }

  /// None: the environment does not tell. @throws ResetNeeded
  std::optional<bool> is_healthy() {
    const Unlocked unlocked(mutex_);
    return episode_->is_healthy();
  }

  /// For pickle and copy.
  py::tuple stored() {
    return py::make_tuple(version(), engine_of(episode_->specification()), id_, parameters_,
                          get_state(std::nullopt));
  }

  /// @throws ValueError where another version stored it, or as `set_state`
  static std::unique_ptr<RecordedEnvironment> from_stored(const py::tuple& stored) {
    constexpr std::size_t kFields = 5;
    if (stored.size() != kFields) throw py::value_error("this is no stored environment");
    auto environment = std::make_unique<RecordedEnvironment>(stored[2].cast<std::string>(),
                                                             stored[3].cast<py::dict>());
    const std::string engine = engine_of(environment->episode_->specification());
    if (stored[0].cast<std::string>() != version() || stored[1].cast<std::string>() != engine) {
      throw py::value_error("stored by walker_sim " + stored[0].cast<std::string>() + " on " +
                            stored[1].cast<std::string>() + "; this is walker_sim " + version() +
                            " on " + engine);
    }
    environment->set_state(stored[4]);
    return environment;
  }

 private:
  py::tuple way_to_state() const {
    const EpisodeState& state = episode_->state();
    const Specification& specification = episode_->specification();
    const bool has_begun = state.episode != 0 && !state.failed_at_reset();
    if (has_begun && !specification.episodes_are_independent) {
      throw py::value_error(
          "with reuse_world an episode depends on those before it, so it cannot be copied or "
          "stored; only an environment before its first reset can");
    }
    if (state.step > kMaxRecordedSteps) {
      throw py::value_error("an episode of more than " + std::to_string(kMaxRecordedSteps) +
                            " steps cannot be copied or stored");
    }
    return py::make_tuple(has_begun, state.generator_state, to_bytes(episode_->actions()),
                          to_bytes(state.observation), episode_->generator_state());
  }

  /// In an environment of its own, whose episode then takes the place of this one's.
  void go_the_way(const py::tuple& way) {
    constexpr std::size_t kFields = 5;
    if (way.size() != kFields) throw py::value_error("this is no state");
    const std::unique_ptr<Episode> scratch = make_recorded(id_, parameters_);
    Episode& repeated = *scratch;
    bool has_begun = false;
    GeneratorState first_state{};
    std::vector<double> actions;
    std::vector<double> observation;
    GeneratorState generator_state{};
    try {
      has_begun = way[0].cast<bool>();
      if (has_begun) first_state = way[1].cast<GeneratorState>();
      actions = from_bytes(way[2]);
      observation = from_bytes(way[3]);
      generator_state = way[4].cast<GeneratorState>();
    } catch (const py::cast_error&) {
      throw py::value_error("this is no state");
    }
    if (has_begun) {
      const Released released;
      repeated.begin(first_state, std::nullopt);
      if (repeated.state().failed_at_reset()) throw std::runtime_error(repeated.state().error);
      repeated.repeat(actions);
    }
    if (has_begun && !have_equal_bits(repeated.state().observation, observation)) {
      throw py::value_error(
          "the stored episode of " + id_ +
          " comes out differently here; has a file changed that its parameters name?");
    }
    if (generator_state != GeneratorState{}) repeated.set_generator_state(generator_state);
    const Unlocked unlocked(mutex_);
    episode_->take_over(repeated);
  }

  /// @throws std::runtime_error with the engine's words where it fails
  void begin(const GeneratorState& generator_state) {
    episode_->begin(generator_state, std::nullopt);
    if (episode_->state().failed_at_reset()) throw std::runtime_error(episode_->state().error);
  }

  std::string id_;
  Parameters parameters_;
  mutable std::mutex mutex_;
  std::unique_ptr<Episode> episode_;
};

}  // namespace

void bind_environment(py::module& module) {
  py::class_<RecordedEnvironment>(module, "Environment")
      .def(py::init<std::string, const py::dict&>(), py::arg("id"), py::arg("parameters"))
      .def_property_readonly("specification", &RecordedEnvironment::specification)
      .def("reset", &RecordedEnvironment::reset)
      .def("step", &RecordedEnvironment::step)
      .def("capture", &RecordedEnvironment::capture)
      .def("get_state", &RecordedEnvironment::get_state)
      .def("set_state", &RecordedEnvironment::set_state)
      .def("set_coordinates", &RecordedEnvironment::set_coordinates)
      .def_property_readonly("is_healthy", &RecordedEnvironment::is_healthy)
      .def(py::pickle([](RecordedEnvironment& environment) { return environment.stored(); },
                      &RecordedEnvironment::from_stored));
}

}  // namespace walker::python
