#include <pybind11/stl.h>
#include <unistd.h>

#include <atomic>
#include <cstddef>
#include <memory>
#include <optional>
#include <shared_mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "base/engine_release.h"
#include "base/posix.h"
#include "episode/episode.h"
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

/// An environment that can be copied and pickled. Thread-safe: a mutex serialises the calls, and
/// threads wait for it without the GIL.
class EnvironmentBinding {
 public:
  /// @throws ValueError as `make`, TypeError as `to_parameters`
  EnvironmentBinding(std::string id, const py::dict& parameters)
      : id_(std::move(id)),
        parameters_(to_parameters(parameters)),
        episode_(make_episode(id_, parameters_)) {}

  py::dict specification() const { return to_dict(episode_->specification()); }

  /// @return the generator's state afterwards, and the engine's message if it failed, or an empty
  ///         text
  std::tuple<GeneratorState, std::string> reset(const GeneratorState& generator_state,
                                                py::handle observation, py::handle info) {
    const EpisodeState& state = episode_->state();
    Output observations(observation, "observation", state.observation.size());
    Output infos(info, "info", state.info.size());
    const GilFreeLock lock(mutex_);
    episode_->set_generator_state(generator_state);
    episode_->reset(std::nullopt);
    observations.write(state.observation.data());
    infos.write(state.info.data());
    return {episode_->generator_state(), state.error};
  }

  /// @return reward, terminated, truncated, and the engine's error or an empty text
  std::tuple<double, bool, bool, std::string> step(py::handle action, py::handle observation,
                                                   py::handle info) {
    const EpisodeState& state = episode_->state();
    const Input actions(action, "action");
    Output observations(observation, "observation", state.observation.size());
    Output infos(info, "info", state.info.size());
    const GilFreeLock lock(mutex_);
    episode_->step(actions.data(), actions.size());
    observations.write(state.observation.data());
    infos.write(state.info.data());
    return {state.reward, state.terminated, state.truncated, state.error};
  }

  /// Sets the world of the resets to come.
  /// @param world pairs (low, high) by name; empty: Gymnasium's
  /// @throws ValueError as `check_world`
  void set_world(const py::dict& world) {
    const World ranges = to_world(world);
    const GilFreeLock lock(mutex_);
    episode_->set_world(ranges);
  }

  /// The world of the resets to come.
  World world() {
    const GilFreeLock lock(mutex_);
    return episode_->world();
  }

  /// What the episode has drawn from its world.
  WorldValues world_values() {
    const GilFreeLock lock(mutex_);
    return episode_->world_values();
  }

  /// Copies the state that a picture shows.
  /// @throws ResetNeeded if there is none
  StateCapture capture() {
    StateCapture captured;
    const GilFreeLock lock(mutex_);
    episode_->capture(captured);
    return captured;
  }

  /// Saves everything that later calls depend on.
  /// @param generator_state if not None, is set before saving
  py::bytes get_state(const std::optional<GeneratorState>& generator_state) {
    std::vector<std::byte> bytes;
    {
      const GilFreeLock lock(mutex_);
      if (generator_state) episode_->set_generator_state(*generator_state);
      episode_->save_state(bytes);
    }
    return to_bytes(bytes);
  }

  /// @param state of an environment with the same id, parameters and engine
  /// @return the generator's state; all zero: there is none
  /// @throws ValueError naming the fault, TypeError if the state is not bytes; then nothing has
  ///         changed
  GeneratorState set_state(const py::object& state) {
    const std::vector<std::byte> bytes = to_state_bytes(state);
    const GilFreeLock lock(mutex_);
    episode_->load_state(bytes.data(), bytes.size());
    return episode_->generator_state();
  }

  /// As Environment::set_coordinates.
  void set_coordinates(py::handle position, py::handle velocity) {
    const Input positions(position, "qpos");
    const Input velocities(velocity, "qvel");
    const GilFreeLock lock(mutex_);
    episode_->set_coordinates({positions.data(), positions.data() + positions.size()},
                              {velocities.data(), velocities.data() + velocities.size()});
  }

  /// None: the robot does not define this. @throws ResetNeeded
  std::optional<bool> is_healthy() {
    const GilFreeLock lock(mutex_);
    return episode_->is_healthy();
  }

  py::tuple pickle() {
    return py::make_tuple(version(), engine_of(episode_->specification()), id_, parameters_,
                          get_state(std::nullopt));
  }

  /// @throws ValueError if another version or engine pickled it, or as `set_state`
  static std::unique_ptr<EnvironmentBinding> unpickle(const py::tuple& state) {
    constexpr std::size_t kFields = 5;
    if (state.size() != kFields) throw py::value_error("not a pickled environment");
    auto environment = std::make_unique<EnvironmentBinding>(state[2].cast<std::string>(),
                                                            state[3].cast<py::dict>());
    const std::string engine = engine_of(environment->episode_->specification());
    if (state[0].cast<std::string>() != version() || state[1].cast<std::string>() != engine) {
      throw py::value_error("pickled by walker_sim " + state[0].cast<std::string>() + " on " +
                            state[1].cast<std::string>() + "; this is walker_sim " + version() +
                            " on " + engine);
    }
    environment->set_state(state[4]);
    return environment;
  }

 private:
  std::string id_;
  Parameters parameters_;
  mutable CallMutex mutex_;
  std::unique_ptr<Episode> episode_;
};

/// Lets the exit of Python wait for the pictures that other threads are drawing. Otherwise a daemon
/// thread would draw with an OpenGL whose own exit handlers have run.
class ExitGuard {
 public:
  /// Call without the GIL. Once the exit has begun, blocks every thread but the exiting one
  /// forever.
  std::shared_lock<std::shared_mutex> begin_picture() {
    std::shared_lock lock(mutex_, std::defer_lock);
    const std::thread::id exiting = exiting_;
    if (exiting == std::this_thread::get_id()) return lock;
    while (exiting != std::thread::id()) pause();
    lock.lock();
    return lock;
  }

  void exit() {
    if (num_forks() != num_forks_) return;  // a thread of the parent may hold the mutex
    const GilRelease released;
    exiting_ = std::this_thread::get_id();
    mutex_.lock();  // until the process ends
  }

 private:
  const unsigned num_forks_ = num_forks();
  std::shared_mutex mutex_;
  std::atomic<std::thread::id> exiting_{std::thread::id()};
};

ExitGuard& exit_guard() {
  static auto* const kGuard = new ExitGuard;  // never destroyed: daemon threads outlive the exit
  return *kGuard;
}

/// A thread-safe renderer: a mutex serialises the calls, and threads wait for it without the GIL.
/// No environment waits for it.
class RendererBinding {
 public:
  RendererBinding(const std::string& id, const py::dict& parameters,
                  const py::dict& camera_parameters)
      : renderer_(make_renderer(id, to_parameters(parameters), to_parameters(camera_parameters))) {}

  py::dict camera() const {
    const Camera& camera = renderer_->camera();
    py::dict dict;
    dict["width"] = camera.width;
    dict["height"] = camera.height;
    dict["focal_length"] = camera.focal_length;
    dict["near"] = camera.near;
    dict["far"] = camera.far;
    return dict;
  }

  /// @param rgb   height x width x 3, uint8; None: not drawn
  /// @param depth height x width, float32 [m]; None: not drawn
  void render(const StateCapture& captured, const py::object& rgb, const py::object& depth) {
    const Camera& camera = renderer_->camera();
    const std::size_t num_pixels = static_cast<std::size_t>(camera.width) * camera.height;
    auto colors = to_output<ColorOutput>(rgb, "rgb", 3 * num_pixels);
    auto depths = to_output<DepthOutput>(depth, "depth", num_pixels);
    const GilRelease released;
    const auto picture = exit_guard().begin_picture();
    const CallMutex::Lock lock(mutex_);
    renderer_->render(captured, {colors.has_value(), depths.has_value()}, image_);
    if (colors) colors->write(image_.rgb.data());
    if (depths) depths->write(image_.depth.data());
  }

 private:
  std::unique_ptr<Renderer> renderer_;
  CallMutex mutex_;
  Image image_;
};

}  // namespace

void bind_environment(py::module& module) {
  py::module::import("atexit").attr("register")(py::cpp_function([] { exit_guard().exit(); }));
  py::class_<StateCapture>(module, "StateCapture").def_readonly("step", &StateCapture::step);
  py::class_<RendererBinding>(module, "Renderer")
      .def(py::init<const std::string&, const py::dict&, const py::dict&>())
      .def_property_readonly("camera", &RendererBinding::camera)
      .def("render", &RendererBinding::render);
  py::class_<EnvironmentBinding>(module, "Environment")
      .def(py::init<std::string, const py::dict&>())
      .def_property_readonly("specification", &EnvironmentBinding::specification)
      .def("reset", &EnvironmentBinding::reset)
      .def("step", &EnvironmentBinding::step)
      .def("set_world", &EnvironmentBinding::set_world)
      .def_property_readonly("world",
                             [](EnvironmentBinding& self) { return to_dict(self.world()); })
      .def("world_values", &EnvironmentBinding::world_values)
      .def("capture", &EnvironmentBinding::capture)
      .def("get_state", &EnvironmentBinding::get_state)
      .def("set_state", &EnvironmentBinding::set_state)
      .def("set_coordinates", &EnvironmentBinding::set_coordinates)
      .def_property_readonly("is_healthy", &EnvironmentBinding::is_healthy)
      .def(py::pickle([](EnvironmentBinding& environment) { return environment.pickle(); },
                      &EnvironmentBinding::unpickle));
}

}  // namespace walker::python
