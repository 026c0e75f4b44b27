#include <pybind11/stl.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/checks.h"
#include "base/posix.h"
#include "episode/checked_world.h"
#include "episode/walker.h"
#include "python/bindings.h"
#include "python/conversions.h"
#include "walker_sim/client.h"
#include "walker_sim/environment.h"
#include "walker_sim/pool.h"
#include "walker_sim/registry.h"
#include "walker_sim/renderer.h"
#include "walker_sim/world.h"

namespace walker::python {
namespace py = pybind11;
namespace {

/// Runs pending Python signal handlers and returns whether one raised, as that of Ctrl-C does; the
/// exception is then set. Python handles signals in its main thread only.
bool raises_after_signal() {
  acquire_gil();
  const bool raises = PyErr_CheckSignals() != 0;
  PyEval_SaveThread();
  return raises;
}

/// Copies values of an answer into the caller's array.
/// @throws ConnectionError if their numbers differ: the server's specification determines the
///         answer's, the expected environment the array's
template <typename Values, typename Destination>
void write_answer(const Values& values, Destination& destination) {
  if (values.size() != destination.size()) {
    throw ConnectionError("the server answers with " + std::to_string(values.size()) +
                          " values of " + destination.name() + " where " +
                          std::to_string(destination.size()) +
                          " were expected; has it been started again with other parameters?");
  }
  destination.write(values.data());
}

/// State of an episode on the server, according to its answers.
struct RemoteEpisode {
  EpisodeState state;  ///< without action, observation and info
  std::string error;   ///< engine's error in the last ~step_batch

  /// Records the position after a number of steps.
  /// @throws ConnectionError if it does not follow the last one: another client, or an earlier call
  ///         that failed, has moved the walker
  void follow(std::uint32_t episode, std::uint32_t step, std::uint32_t num_steps = 1) {
    const bool is_same_episode = !is_placed || episode == state.episode;
    if (!is_same_episode || step != state.step + num_steps) {
      throw ConnectionError("the server answers with step " + std::to_string(step) +
                            " of episode " + std::to_string(episode) + " where step " +
                            std::to_string(state.step + num_steps) +
                            " was expected: another client, or an earlier call that failed, has "
                            "moved the walker; reset first");
    }
    place(episode, step);
  }

  void place(std::uint32_t episode, std::uint32_t step) {
    state.episode = episode;
    state.step = step;
    is_placed = true;
  }

  /// Records a transition of this environment.
  void place(const Transition& transition) {
    place(transition.episode, transition.step);
    state.terminated = transition.terminated;
    state.truncated = transition.truncated;
    state.error = transition.error;
  }

  /// Begins an episode after ~reset_batch, whose answer has no episode counts.
  void begin() {
    state = {};
    state.episode = 1;
    is_placed = false;
  }

  /// @param drawn at the reset; empty: Gymnasium's world
  void set_world(const World& drawn) {
    state.world = drawn.empty() ? nullptr : std::make_shared<const World>(drawn);
  }

  void fail_at_reset(const std::string& message) {
    state.step = 0;
    state.terminated = true;
    state.error = message;
  }

  bool is_placed = false;  ///< whether `state.episode` is the server's count
};

/// Client whose results are written into NumPy arrays. Thread-safe: a mutex serialises the calls.
/// Calls that the core would refuse in process are refused here, with the same message.
class ClientBinding {
 public:
  /// @param id, parameters the expected environment: it checks actions, and the caller compares its
  ///                       specification with the server's
  ClientBinding(const std::string& id, const py::dict& parameters, std::string server,
                std::string master_uri, double timeout, std::int64_t spin_us)
      : specification_(make(id, to_parameters(parameters))->specification()) {
    const ClientOptions options{std::move(server),    std::move(master_uri), timeout,
                                &raises_after_signal, /*caller=*/{},         spin_us};
    call([&] {
      client_.emplace(options);
      server_ = client_->specification();
    });
    episodes_.resize(server_.num_envs);
    autoreset_mode_ = find_autoreset_mode(server_.autoreset_mode).value_or(AutoresetMode::disabled);
  }

  /// Specification of the expected environment.
  py::dict specification() const { return to_dict(specification_); }
  py::dict server_specification() const { return to_dict(server_); }
  /// Whether a call failed or was refused unexpectedly, so that the server may be another one now.
  /// Also true in the child of a fork, because the connections belong to the parent.
  bool is_lost() const { return is_lost_ || is_forked(); }

  /// @param world pairs (low, high) by name; None: the server's own
  void reset(const py::object& seed, py::handle observation, py::handle info,
             const py::object& world) {
    const auto number = to_seed(seed);
    std::optional<World> ranges;
    if (!world.is_none()) ranges = check_worlds(py::make_tuple(world)).front();
    Output observations(observation, "observation");
    Output infos(info, "info");
    call([&] {
      client_->reset(number, ranges, reset_);
      record_reset();
      write_answer(reset_.transition.observation, observations);
      write_answer(reset_.transition.info, infos);
    });
  }

  /// Converts worlds. The server checks them, too; here, errors are those in process, and no
  /// episode is lost.
  std::vector<World> check_worlds(const py::sequence& given) const {
    std::vector<World> worlds = to_worlds(given);
    for (const World& world : worlds) CheckedWorld::share(specification_, world);
    return worlds;
  }

  /// Sets the worlds of the resets to come.
  /// @param environments indices; empty: all
  /// @param worlds pairs (low, high) by name; one for all, or one per listed environment
  void set_world(const std::vector<std::uint32_t>& environments, const py::sequence& worlds) {
    const std::vector<World> ranges = check_worlds(worlds);
    call(
        [&] {
          for (const std::uint32_t environment : environments) check_index(environment);
          client_->set_world(environments, ranges);
        },
        /*refusal_loses=*/false);
  }

  /// As Pool.drawn_worlds, for all environments.
  std::map<std::size_t, World> drawn_worlds(const py::sequence& /*environments*/) {
    const GilFreeLock lock = enter();
    std::map<std::size_t, World> drawn;
    for (const auto& [environment, world] : batch_.worlds) drawn[environment] = world;
    return drawn;
  }

  /// What the environments' episodes have drawn from their worlds.
  std::vector<World> episode_worlds(const std::vector<std::uint32_t>& environments) {
    const GilFreeLock lock = enter();
    std::vector<World> worlds;
    for (const std::uint32_t i : environments) {
      worlds.push_back(episodes_.at(i).state.drawn_world());
    }
    return worlds;
  }

  /// @return as Pool.step_single
  std::tuple<double, bool, bool, std::string> step(py::handle action, py::handle observation,
                                                   py::handle info) {
    const Input actions(action, "action");
    Output observations(observation, "observation");
    Output infos(info, "info");
    return call([&] {
      check_step(actions);
      client_->step(actions.data(), actions.size(), transition_);
      episodes_.front().follow(transition_.episode, transition_.step);
      episodes_.front().place(transition_);
      write_answer(transition_.observation, observations);
      write_answer(transition_.info, infos);
      return std::make_tuple(transition_.reward, transition_.terminated, transition_.truncated,
                             transition_.error);
    });
  }

  /// Returns the present episode as an opaque record.
  py::bytes snapshot() {
    std::vector<std::uint8_t> record;
    call(
        [&] {
          check_episode("get_state", 0);
          client_->snapshot(record);
        },
        /*refusal_loses=*/false);
    return to_bytes(record);
  }

  void restore(const py::handle& record) {
    const std::vector<std::byte> bytes = to_state_bytes(record);
    const auto* const begin = reinterpret_cast<const std::uint8_t*>(bytes.data());
    call(
        [&] {
          client_->restore({begin, begin + bytes.size()}, reset_);
          record_reset();
        },
        /*refusal_loses=*/false);
    is_lost_ = false;
  }

  /// As Pool.set_coordinates.
  void set_coordinates(std::uint32_t environment, py::handle position, py::handle velocity) {
    const std::vector<double> positions = Input(position, "qpos").to_vector();
    const std::vector<double> velocities = Input(velocity, "qvel").to_vector();
    call(
        [&] {
          check_episode("set_state", environment);
          RemoteEpisode& episode = episodes_[environment];
          if (!episode.state.error.empty()) {
            throw ResetNeeded("set_state: " + episode.state.step_refusal() + "; reset first");
          }
          check_coordinates(specification_, positions, velocities);
          client_->set_state(environment, positions, velocities, transition_);
          episode.follow(transition_.episode, transition_.step, 0);
          episode.place(transition_);
        },
        /*refusal_loses=*/false);
  }

  /// @param environments indices, in the order of the rows; empty: all
  /// @param worlds        as for set_world; empty: the server's own
  void reset_batch(const std::vector<std::uint32_t>& environments, const py::sequence& seeds,
                   py::handle observations, py::handle info, const py::sequence& worlds) {
    const auto numbers = to_seeds(seeds);
    const std::vector<World> ranges = check_worlds(worlds);
    Output observations_output(observations, "observations");
    Output info_output(info, "info");
    call([&] {
      for (const std::uint32_t environment : environments) check_index(environment);
      client_->reset_batch(environments, numbers, ranges, batch_reset_);
      write_answer(batch_reset_.observations, observations_output);
      write_answer(batch_reset_.info, info_output);
      if (environments.empty()) {
        for (RemoteEpisode& episode : episodes_) episode.begin();
      }
      for (const std::uint32_t environment : environments) episodes_[environment].begin();
      record_worlds(batch_reset_.worlds);
      for (std::size_t i = 0; i < batch_reset_.failures.size(); ++i) {
        const std::uint32_t failed = batch_reset_.failed_environments[i];
        episodes_[failed].fail_at_reset(batch_reset_.failures[i]);
      }
    });
  }

  // As Pool.error and Pool.reset_error.
  std::string error(std::size_t index) {
    const GilFreeLock lock = enter();
    return episodes_.at(index).error;
  }
  std::string reset_error(std::size_t index) {
    const GilFreeLock lock = enter();
    const EpisodeState& state = episodes_.at(index).state;
    return state.failed_at_reset() ? state.error : "";
  }

  void step_batch(py::handle actions, const py::sequence& batch) {
    const Input input(actions, "actions");
    StepOutputs outputs(batch);
    call([&] {
      check_steps(input);
      client_->step_batch(input.data(), input.size(), batch_);
      record_batch();
      write_answer(batch_.observations, outputs.observations);
      write_answer(batch_.rewards, outputs.rewards);
      write_answer(batch_.terminated, outputs.terminated);
      write_answer(batch_.truncated, outputs.truncated);
      write_answer(batch_.info, outputs.info);
    });
  }

  /// Draws one environment, as Renderer.render does. A failure does not set `is_lost`.
  void render(std::uint32_t environment, const py::dict& camera_parameters, const py::object& rgb,
              const py::object& depth) {
    const Parameters camera = to_parameters(camera_parameters);
    auto colors = to_output<ColorOutput>(rgb, "rgb");
    auto depths = to_output<DepthOutput>(depth, "depth");
    try {
      const GilFreeLock lock = enter();
      check_episode("render", environment);
      if (colors) {
        client_->render(environment, "rgb8", camera, image_);
        write_answer(image_.rgb, *colors);
      }
      if (depths) {
        client_->render(environment, "32FC1", camera, image_);
        write_answer(image_.depth, *depths);
      }
    } catch (const Interrupted&) {
      throw py::error_already_set();
    }
  }

  /// As Pool.final_rows.
  void final_rows(py::handle observations, py::handle info) {
    Output observations_output(observations, "observations");
    Output info_output(info, "info");
    call([&] {
      write_answer(scattered(batch_.final_observations, server_.observation_size),
                   observations_output);
      write_answer(scattered(batch_.final_info, server_.info_names.size()), info_output);
    });
  }

 private:
  bool is_forked() const { return num_forks() != num_forks_; }

  /// @throws ConnectionError in the child of a fork, where the mutex may stay locked forever
  GilFreeLock enter() {
    if (is_forked()) throw ConnectionError(kForkedClientError);
    return GilFreeLock(mutex_);
  }

  /// Runs the function without the GIL. `is_lost` is set by a ConnectionError, by an interruption
  /// and, if `refusal_loses`, by a refusal: this client has checked the call, so the server's state
  /// must differ from the known one.
  /// @throws as the function; the exception that a signal handler has raised
  template <typename Function>
  std::invoke_result_t<Function> call(const Function& function, bool refusal_loses = true) {
    bool has_begun = false;
    try {
      const GilFreeLock lock = enter();
      has_begun = true;
      return function();
    } catch (const ConnectionError&) {
      is_lost_ = true;
      throw;
    } catch (const RequestRefused&) {
      if (refusal_loses) is_lost_ = true;
      throw;
    } catch (const Interrupted&) {
      is_lost_ = is_lost_ || has_begun;  // else another thread's call was awaited
      throw py::error_already_set();
    }
  }

  void check_index(std::uint32_t environment) const {
    if (environment < episodes_.size()) return;
    throw py::index_error("environment " + std::to_string(environment) + ": must be in [0, " +
                          std::to_string(episodes_.size() - 1) + "]");
  }

  /// Requires an episode that this client began: any other may belong to another client.
  void check_episode(const std::string& call, std::uint32_t environment) const {
    check_index(environment);
    if (is_lost_) throw ResetNeeded(call + ": " + kLost);
    if (episodes_[environment].state.has_begun()) return;
    throw ResetNeeded(call + ": there is no episode yet; reset first");
  }

  void check_step(const Input& action) const {
    if (is_lost_) throw ResetNeeded(std::string("step: ") + kLost);
    const std::string refusal = episodes_.front().state.step_refusal();
    if (!refusal.empty()) throw ResetNeeded("step: " + refusal + "; reset first");
    check_action(specification_, action.data(), action.size());
  }

  void check_steps(const Input& actions) const {
    if (is_lost_) throw ResetNeeded(std::string("step: ") + kLost);
    check_actions_size(specification_, actions.size(), episodes_.size());
    for (std::size_t i = 0; i < episodes_.size(); ++i) {
      check_action_of(i, specification_, actions.data() + i * specification_.action_size());
      const std::string refusal = episodes_[i].state.step_refusal(autoreset_mode_);
      if (refusal.empty()) continue;
      throw ResetNeeded("environment " + std::to_string(i) + ": " + refusal + "; reset first");
    }
  }

  /// Records the answer of ~reset or ~restore.
  void record_reset() {
    episodes_.front().place(reset_.transition);
    episodes_.front().set_world(reset_.world);
  }

  void record_worlds(const std::vector<EnvironmentWorld>& worlds) {
    for (const auto& [environment, world] : worlds) episodes_[environment].set_world(world);
  }

  /// Records the answer of ~step_batch. Step 0 means that the server has reset the environment; it
  /// may follow any earlier step.
  void record_batch() {
    for (std::size_t i = 0; i < episodes_.size(); ++i) {
      RemoteEpisode& episode = episodes_[i];
      if (batch_.steps[i] != 0) {
        episode.follow(batch_.episodes[i], batch_.steps[i]);
      } else {
        episode.place(batch_.episodes[i], 0);
        episode.state.world = nullptr;
      }
      // At step 0 the flags belong to the previous episode.
      episode.state.terminated = batch_.steps[i] != 0 && batch_.terminated[i] != 0;
      episode.state.truncated = batch_.steps[i] != 0 && batch_.truncated[i] != 0;
      episode.state.error.clear();
      episode.error.clear();
    }
    record_worlds(batch_.worlds);
    for (std::size_t i = 0; i < batch_.failures.size(); ++i) {
      RemoteEpisode& episode = episodes_[batch_.failed_environments[i]];
      if (batch_.failed_at_reset[i] != 0) {
        episode.fail_at_reset(batch_.failures[i]);
      } else {
        episode.error = batch_.failures[i];
      }
    }
  }

  /// Returns one row per environment: its final row if its episode has just ended, else zeros.
  /// @param width as in the server's specification, against which the client has checked the rows
  std::vector<double> scattered(const std::vector<double>& rows, std::size_t width) const {
    std::vector<double> all(episodes_.size() * width);
    const double* row = rows.data();
    for (const std::uint32_t environment : batch_.final_environments) {
      std::copy_n(row, width, all.data() + environment * width);
      row += width;
    }
    return all;
  }

  static constexpr const char* kLost = "the server or its episode was lost; reset first";

  Specification specification_;
  std::optional<Client> client_;
  ServerSpecification server_;
  CallMutex mutex_;
  unsigned num_forks_ = num_forks();
  std::atomic<bool> is_lost_{false};
  Transition transition_;
  std::vector<RemoteEpisode> episodes_;  // one per environment
  AutoresetMode autoreset_mode_ = AutoresetMode::disabled;
  Reset reset_;
  BatchReset batch_reset_;
  BatchTransition batch_;
  Image image_;
};

}  // namespace

void bind_client(py::module& module) {
  py::class_<ClientBinding>(module, "Client")
      .def(py::init<const std::string&, const py::dict&, std::string, std::string, double,
                    std::int64_t>(),
           py::arg("id"), py::arg("parameters"), py::arg("server"), py::arg("master_uri"),
           py::arg("timeout"), py::arg("spin_us") = ClientOptions().spin_us)
      .def_property_readonly("specification", &ClientBinding::specification)
      .def_property_readonly("server_specification", &ClientBinding::server_specification)
      .def_property_readonly("is_lost", &ClientBinding::is_lost)
      .def("reset", &ClientBinding::reset, py::arg("seed"), py::arg("observation"), py::arg("info"),
           py::arg("world") = py::none())
      .def("check_worlds",
           [](const ClientBinding& self, const py::sequence& worlds) { self.check_worlds(worlds); })
      .def("set_world", &ClientBinding::set_world)
      .def("episode_worlds", drawn_by(&ClientBinding::episode_worlds))
      .def("drawn_worlds", drawn_by(&ClientBinding::drawn_worlds))
      .def("step_single", &ClientBinding::step)
      .def("snapshot", &ClientBinding::snapshot)
      .def("restore", &ClientBinding::restore)
      .def("set_coordinates", &ClientBinding::set_coordinates)
      .def("reset_batch", &ClientBinding::reset_batch, py::arg("environments"), py::arg("seeds"),
           py::arg("observations"), py::arg("info"), py::arg("worlds") = py::tuple())
      .def("step_batch", &ClientBinding::step_batch)
      .def("final_rows", &ClientBinding::final_rows)
      .def("error", &ClientBinding::error)
      .def("reset_error", &ClientBinding::reset_error)
      .def("render", &ClientBinding::render);
}

}  // namespace walker::python
