#include <pybind11/stl.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "base/engine_release.h"
#include "base/interruption.h"
#include "episode/walker.h"
#include "python/bindings.h"
#include "python/conversions.h"
#include "python/shown_state.h"
#include "walker_sim/pool.h"
#include "walker_sim/registry.h"

namespace walker::python {
namespace py = pybind11;
namespace {

std::string engine_of(const Specification& specification) {
  return specification.engine + " " + engine_release(specification.engine_version);
}

/// A pool whose threads write rows into NumPy arrays; it can be copied and pickled. Thread-safe: a
/// mutex serialises the calls, and threads wait for it without the GIL.
class PoolBinding {
 public:
  PoolBinding(std::string id, const py::dict& parameters, std::size_t num_envs,
              std::size_t num_threads, const std::string& autoreset_mode, std::size_t batch_size)
      : id_(std::move(id)),
        parameters_(to_parameters(parameters)),
        options_{num_envs, num_threads, find_autoreset_mode(autoreset_mode).value(), batch_size},
        pool_([this] { return make(id_, parameters_); }, options_),
        specification_(std::make_shared<const Specification>(pool_.specification())),
        received_(pool_.options().batch_size) {
    if (options_.autoreset_mode != AutoresetMode::same_step) return;
    final_observations_.resize(options_.num_envs * observation_size());
    final_info_.resize(options_.num_envs * num_infos());
  }

  py::dict specification() const { return to_dict(pool_.specification()); }
  std::size_t num_threads() const { return pool_.options().num_threads; }
  std::size_t batch_size() const { return pool_.options().batch_size; }

  /// Begins episodes from the present states of the generators.
  /// @param environments indices; empty: all
  /// @param observations, info receive rows of all environments, including those not reset
  void reset(const std::vector<std::uint32_t>& environments, py::handle observations,
             py::handle info) {
    Output observations_output(observations, "observations",
                               options_.num_envs * observation_size());
    NumberOutput info_output(info, "info", options_.num_envs * num_infos());
    const GilFreeLock lock(mutex_);
    pool_.reset(environments, {}, {});
    for (std::size_t i = 0; i < options_.num_envs; ++i) {
      const EpisodeState& state = pool_.walker(i).state();
      observations_output.write_row(i, state.observation);
      std::copy(state.info.begin(), state.info.end(), info_output.data() + i * num_infos());
    }
  }

  void step(py::handle actions, const py::sequence& batch) {
    const Input input(actions, "actions");
    StepOutputs outputs = outputs_of(batch, options_.num_envs);
    const GilFreeLock lock(mutex_);
    pool_.step(input.data(), input.size(), rows_of(outputs));
  }

  // Calls for a single environment (row 0) in one lock each, so that threads may share it.

  /// Begins an episode from this state of the generator.
  /// @return the generator's state afterwards, and the engine's message if it failed, or an empty
  ///         text
  std::tuple<GeneratorState, std::string> reset_single(const GeneratorState& generator_state,
                                                       py::handle observation, py::handle info) {
    Output observations(observation, "observation", observation_size());
    Output infos(info, "info", num_infos());
    const GilFreeLock lock(mutex_);
    Walker& walker = pool_.walker(0);
    walker.set_generator_state(generator_state);
    walker.reset(std::nullopt);
    const EpisodeState& state = walker.state();
    observations.write(state.observation.data());
    infos.write(state.info.data());
    return {walker.generator_state(), state.error};
  }

  /// @param generator_state if not None, is set before saving
  py::bytes get_state(const std::optional<GeneratorState>& generator_state) {
    std::vector<std::byte> state;
    {
      const GilFreeLock lock(mutex_);
      if (generator_state) pool_.walker(0).set_generator_state(*generator_state);
      pool_.save_state(0, state);
    }
    return to_bytes(state);
  }

  /// @return the generator's state; all zero: there is none
  /// @throws ValueError naming the fault, TypeError if the state is not bytes; then nothing has
  ///         changed
  GeneratorState set_state(const py::object& given) {
    const std::vector<std::byte> state = to_state_bytes(given);
    const GilFreeLock lock(mutex_);
    Walker& walker = pool_.walker(0);
    walker.load_state(state.data(), state.size());
    record_worlds(walker);
    return walker.generator_state();
  }

  /// Steps without a reset at the episode's end.
  /// @return reward, terminated, truncated, and the engine's error or an empty text
  std::tuple<double, bool, bool, std::string> step_single(py::handle action, py::handle observation,
                                                          py::handle info) {
    const Input actions(action, "action");
    Output observations(observation, "observation", observation_size());
    Output infos(info, "info", num_infos());
    const GilFreeLock lock(mutex_);
    Walker& walker = pool_.walker(0);
    walker.step(actions.data(), actions.size());
    const EpisodeState& state = walker.state();
    observations.write(state.observation.data());
    infos.write(state.info.data());
    return {state.reward, state.terminated, state.truncated, state.error};
  }

  /// Steps some environments. The batch receives a row for each, in their order.
  void step_some(py::handle actions, const std::vector<std::uint32_t>& environments,
                 const py::sequence& batch) {
    const std::size_t count = environments.size();
    const Input input(actions, "actions", count * action_size());
    StepOutputs outputs = outputs_of(batch, count);
    const GilFreeLock lock(mutex_);
    pool_.step(input.data(), environments.data(), count, rows_of(outputs));
  }

  /// same_step only: the final rows of the last step or `recv`. A row is meaningful if that call
  /// ended its environment's episode.
  void final_rows(py::handle observations, py::handle info) {
    Output observations_output(observations, "observations");
    NumberOutput info_output(info, "info");
    if (observations_output.size() > final_observations_.size() ||
        info_output.size() > final_info_.size()) {
      throw py::value_error("final_rows: must be called in same_step, for at most num_envs rows");
    }
    const GilFreeLock lock(mutex_);
    observations_output.write(final_observations_.data());
    info_output.write(final_info_.data());
  }

  void send(py::handle actions, const std::vector<std::uint32_t>& environments) {
    const Input input(actions, "actions", environments.size() * action_size());
    const GilFreeLock lock(mutex_);
    pool_.send(input.data(), environments.data(), environments.size());
  }

  void send_resets(const std::vector<std::uint32_t>& environments) {
    const GilFreeLock lock(mutex_);
    pool_.send_resets(environments);
  }

  /// @return the index of each row's environment
  std::vector<std::uint32_t> recv(const py::sequence& batch) {
    StepOutputs outputs = outputs_of(batch, received_.size());
    const GilFreeLock lock(mutex_);
    pool_.recv(rows_of(outputs), received_.data());
    return received_;
  }

  /// Sets the worlds of environments' resets to come.
  /// @param environments indices; empty: all
  /// @param worlds one for all or one each: pairs (low, high) by name; empty: Gymnasium's
  /// @throws ValueError as `check_world`, or if the number of worlds is wrong
  void set_world(const std::vector<std::uint32_t>& environments, const py::sequence& worlds) {
    const std::vector<World> ranges = to_worlds(worlds);
    const GilFreeLock lock(mutex_);
    pool_.set_world(environments, ranges);
    for (const World& world : ranges) has_worlds_ = has_worlds_ || !world.empty();
  }

  World world(std::size_t index) {
    const GilFreeLock lock(mutex_);
    return pool_.environment(index).world();
  }

  /// What the environments' episodes have drawn from their worlds.
  std::vector<World> episode_worlds(const std::vector<std::uint32_t>& environments) {
    std::vector<World> worlds(environments.size());
    if (!has_worlds_) return worlds;
    const GilFreeLock lock(mutex_);
    for (std::size_t i = 0; i < worlds.size(); ++i) {
      worlds[i] = pool_.environment(environments[i]).drawn_world();
    }
    return worlds;
  }

  /// Returns what was drawn by the episodes that the last step or `recv` has begun in a world, by
  /// row.
  /// @param environments index of each row's environment
  std::map<std::size_t, World> drawn_worlds(const py::sequence& environments) {
    std::map<std::size_t, World> rows;
    if (!has_worlds_) return rows;
    const auto indices = environments.cast<std::vector<std::uint32_t>>();
    const GilFreeLock lock(mutex_);
    for (std::size_t row = 0; row < indices.size(); ++row) {
      const EpisodeState& state = pool_.walker(indices[row]).state();
      if (state.step == 0 && state.world) rows[row] = *state.world;
    }
    return rows;
  }

  /// Adds a wrench to an environment's next step, as Walker::push does.
  /// @param link    index: 0 for the trunk, i for the link that joint i - 1 turns
  /// @param force_x, force_z, torque_y in axes of the world, at the link's origin [N, N m]
  void push(std::size_t index, std::uint32_t link, double force_x, double force_z,
            double torque_y) {
    const GilFreeLock lock(mutex_);
    pool_.walker(index).push({link, force_x, force_z, torque_y});
  }

  /// As Environment::set_coordinates.
  void set_coordinates(std::size_t index, py::handle position, py::handle velocity) {
    const std::vector<double> positions = Input(position, "qpos").to_vector();
    const std::vector<double> velocities = Input(velocity, "qvel").to_vector();
    const GilFreeLock lock(mutex_);
    pool_.walker(index).set_coordinates(positions, velocities);
  }

  /// None: the robot does not define this. @throws ResetNeeded
  std::optional<bool> is_healthy(std::size_t index) {
    const GilFreeLock lock(mutex_);
    return pool_.walker(index).is_healthy();
  }

  py::list get_states(const std::vector<std::uint32_t>& environments) {
    std::vector<std::vector<std::byte>> states(environments.size());
    {
      const GilFreeLock lock(mutex_);
      for (std::size_t i = 0; i < states.size(); ++i) {
        check_step_interruption();
        pool_.save_state(environments[i], states[i]);
      }
    }
    py::list list;
    for (const std::vector<std::byte>& state : states) list.append(to_bytes(state));
    return list;
  }

  /// @throws ValueError naming the environment and the fault; then nothing has changed
  void set_states(const std::vector<std::uint32_t>& environments, const py::sequence& given) {
    std::vector<std::vector<std::byte>> states;
    for (const py::handle state : given) states.push_back(to_state_bytes(state));
    if (environments.empty() && states.empty()) return;
    const GilFreeLock lock(mutex_);
    pool_.load_states(environments, states, {});
    for (const std::uint32_t index : environments) record_worlds(pool_.walker(index));
  }

  py::tuple pickle() {
    return py::make_tuple(version(), engine_of(pool_.specification()), id_, parameters_,
                          options_.num_envs, options_.num_threads, to_text(options_.autoreset_mode),
                          options_.batch_size, get_states(all()));
  }

  /// @throws ValueError if another version or engine pickled it, or as `set_states`
  static std::unique_ptr<PoolBinding> unpickle(const py::tuple& state) {
    constexpr std::size_t kFields = 9;
    if (state.size() != kFields) throw py::value_error("not a pickled pool");
    auto pool = std::make_unique<PoolBinding>(
        state[2].cast<std::string>(), state[3].cast<py::dict>(), state[4].cast<std::size_t>(),
        state[5].cast<std::size_t>(), state[6].cast<std::string>(), state[7].cast<std::size_t>());
    const std::string engine = engine_of(pool->pool_.specification());
    if (state[0].cast<std::string>() != version() || state[1].cast<std::string>() != engine) {
      throw py::value_error("pickled by walker_sim " + state[0].cast<std::string>() + " on " +
                            state[1].cast<std::string>() + "; this is walker_sim " + version() +
                            " on " + engine);
    }
    pool->set_states(pool->all(), state[8].cast<py::list>());
    return pool;
  }

  ShownState capture(std::size_t index) {
    ShownState captured;
    captured.specification = specification_;
    const GilFreeLock lock(mutex_);
    pool_.walker(index).capture(captured);
    return captured;
  }

  std::string error(std::size_t index) {
    const GilFreeLock lock(mutex_);
    return pool_.error(index);
  }

  std::string reset_error(std::size_t index) {
    const GilFreeLock lock(mutex_);
    return pool_.reset_error(index);
  }

  GeneratorState generator_state(std::size_t index) {
    const GilFreeLock lock(mutex_);
    return pool_.environment(index).generator_state();
  }

  void set_generator_states(const std::map<std::size_t, GeneratorState>& states) {
    const GilFreeLock lock(mutex_);
    for (const auto& each : states) pool_.environment(each.first);  // checks all first
    for (const auto& [index, state] : states) pool_.environment(index).set_generator_state(state);
  }

 private:
  void record_worlds(const Walker& walker) {
    has_worlds_ = has_worlds_ || walker.state().world || !walker.world().empty();
  }

  std::vector<std::uint32_t> all() const {
    std::vector<std::uint32_t> indices(options_.num_envs);
    std::iota(indices.begin(), indices.end(), 0U);
    return indices;
  }

  std::size_t observation_size() const { return pool_.specification().observation_size(); }
  std::size_t action_size() const { return pool_.specification().action_size(); }
  std::size_t num_infos() const { return pool_.specification().info_names.size(); }

  StepOutputs outputs_of(const py::sequence& batch, std::size_t count) const {
    return StepOutputs(batch, count, count * observation_size(), count * num_infos());
  }

  Batch rows_of(StepOutputs& outputs) {
    Batch rows;
    rows.observations = outputs.observations.doubles();
    rows.single_observations = outputs.observations.singles();
    rows.rewards = outputs.rewards.data();
    rows.terminated = outputs.terminated.data();
    rows.truncated = outputs.truncated.data();
    rows.info = outputs.info.data();
    rows.final_observations = final_observations_.data();
    rows.final_info = final_info_.data();
    return rows;
  }

  std::string id_;
  Parameters parameters_;
  PoolOptions options_;
  Pool pool_;
  std::shared_ptr<const Specification> specification_;  // outlives the pool in captured states
  CallMutex mutex_;
  std::atomic<bool> has_worlds_{false};  // false: no environment has a world
  std::vector<std::uint32_t> received_;  // indices of the last `recv`
  // same_step: final rows of the last step or `recv`, in the order of its rows.
  std::vector<double> final_observations_;
  std::vector<double> final_info_;
};

/// Copies rows of info into columns, and sets the masks of values that are not NaN. One native call
/// is faster, because a step of many worlds evicts NumPy's code from the processor's caches.
/// @param values, masks zeros, one row per column of `info`
/// @return for each column, whether any row has a value
std::vector<bool> info_columns(py::handle info, std::size_t num_columns, py::handle values,
                               py::handle masks) {
  const Input rows(info, "info");
  NumberOutput values_output(values, "values", rows.size());
  FlagOutput masks_output(masks, "masks", rows.size());
  const std::size_t num_rows = rows.size() / num_columns;
  std::vector<bool> has_any(num_columns);
  for (std::size_t column = 0; column < num_columns; ++column) {
    for (std::size_t row = 0; row < num_rows; ++row) {
      const double value = rows.data()[row * num_columns + column];
      if (std::isnan(value)) continue;
      values_output.data()[column * num_rows + row] = value;
      masks_output.data()[column * num_rows + row] = 1;
      has_any[column] = true;
    }
  }
  return has_any;
}

}  // namespace

void bind_pool(py::module& module) {
  module.def("info_columns", &info_columns);
  py::class_<PoolBinding>(module, "Pool")
      .def(py::init<const std::string&, const py::dict&, std::size_t, std::size_t,
                    const std::string&, std::size_t>(),
           py::arg("id"), py::arg("parameters"), py::arg("num_envs") = 1,
           py::arg("num_threads") = 1, py::arg("autoreset_mode") = "disabled",
           py::arg("batch_size") = 0)
      .def_property_readonly("specification", &PoolBinding::specification)
      .def_property_readonly("num_threads", &PoolBinding::num_threads)
      .def_property_readonly("batch_size", &PoolBinding::batch_size)
      .def("reset", &PoolBinding::reset)
      .def("step_batch", &PoolBinding::step)
      .def("reset_single", &PoolBinding::reset_single)
      .def("step_single", &PoolBinding::step_single)
      .def("get_state", &PoolBinding::get_state)
      .def("set_state", &PoolBinding::set_state)
      .def("step_some", &PoolBinding::step_some)
      .def("final_rows", &PoolBinding::final_rows)
      .def("send", &PoolBinding::send)
      .def("send_resets", &PoolBinding::send_resets)
      .def("recv", &PoolBinding::recv)
      .def("set_world", &PoolBinding::set_world)
      .def("world", [](PoolBinding& self, std::size_t index) { return to_dict(self.world(index)); })
      .def("episode_worlds", drawn_by(&PoolBinding::episode_worlds))
      .def("drawn_worlds", drawn_by(&PoolBinding::drawn_worlds))
      .def("push", &PoolBinding::push)
      .def("capture", &PoolBinding::capture)
      .def("error", &PoolBinding::error)
      .def("reset_error", &PoolBinding::reset_error)
      .def("generator_state", &PoolBinding::generator_state)
      .def("set_generator_states", &PoolBinding::set_generator_states)
      .def("set_coordinates", &PoolBinding::set_coordinates)
      .def("is_healthy", &PoolBinding::is_healthy)
      .def("get_states", &PoolBinding::get_states)
      .def("set_states", &PoolBinding::set_states)
      .def(py::pickle([](PoolBinding& pool) { return pool.pickle(); }, &PoolBinding::unpickle));
}

}  // namespace walker::python
