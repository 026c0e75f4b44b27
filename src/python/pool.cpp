#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "python/arrays.h"
#include "python/bindings.h"
#include "python/conversions.h"
#include "walker_sim/pool.h"
#include "walker_sim/registry.h"
#include "walker_sim/renderer.h"

namespace walker::python {
namespace py = pybind11;
namespace {

PoolOptions make_options(std::size_t num_envs, std::size_t num_threads,
                         const std::string& autoreset_mode, std::size_t batch_size) {
  const auto mode = find_autoreset_mode(autoreset_mode);
  if (!mode) {
    throw py::value_error("autoreset_mode = " + autoreset_mode +
                          ": must be next_step, same_step or disabled");
  }
  return {num_envs, num_threads, *mode, batch_size};
}

/// What a step gives, a row per environment.
struct Rows {
  Rows(const Specification& specification, std::size_t count)
      : observations(count * specification.observation_size()),
        rewards(count),
        terminated(count),
        truncated(count),
        info(count * specification.info_names.size()),
        steps(count),
        final_observations(observations.size()),
        final_info(info.size()) {}

  Batch batch() {
    Batch batch;
    batch.observations = observations.data();
    batch.rewards = rewards.data();
    batch.terminated = terminated.data();
    batch.truncated = truncated.data();
    batch.info = info.data();
    batch.steps = steps.data();
    batch.final_observations = final_observations.data();
    batch.final_info = final_info.data();
    return batch;
  }

  void copy_to(StepOutputs& outputs) const {
    outputs.observations.take(observations.data());
    outputs.rewards.take(rewards.data());
    outputs.terminated.take(terminated.data());
    outputs.truncated.take(truncated.data());
    outputs.info.take(info.data());
  }

  std::vector<double> observations;
  std::vector<double> rewards;
  std::vector<std::uint8_t> terminated;
  std::vector<std::uint8_t> truncated;
  std::vector<double> info;
  std::vector<std::uint32_t> steps;
  std::vector<double> final_observations;
  std::vector<double> final_info;
};

/// A pool that remembers the last row of each environment, so that a reset of some gives all.
class VectorWalkers {
 public:
  VectorWalkers(std::string id, const py::dict& parameters, std::size_t num_envs,
                std::size_t num_threads, const std::string& autoreset_mode, std::size_t batch_size)
      : id_(std::move(id)),
        parameters_(to_parameters(parameters)),
        asked_(make_options(num_envs, num_threads, autoreset_mode, batch_size)),
        pool_([this] { return make(id_, parameters_); }, asked_),
        last_(pool_.specification(), pool_.options().num_envs),
        arrived_(pool_.specification(), pool_.options().batch_size),
        arrived_environments_(pool_.options().batch_size),
        some_(pool_.specification(), 0) {}

  py::dict specification() const { return to_dict(pool_.specification()); }
  std::size_t num_threads() const { return pool_.options().num_threads; }
  std::size_t batch_size() const { return pool_.options().batch_size; }

  /// From the state of each one's generator. Rows of environments that are not reset are as they
  /// last were.
  void reset(const std::vector<std::uint32_t>& environments, py::handle observations,
             py::handle info) {
    Output observations_output(observations, "observations", last_.observations.size());
    Output info_output(info, "info", last_.info.size());
    const Unlocked unlocked(mutex_);
    pool_.reset(environments, {}, last_.batch());
    observations_output.take(last_.observations.data());
    info_output.take(last_.info.data());
  }

  void step(py::handle actions, const py::sequence& batch) {
    const Input input(actions, "actions");
    StepOutputs outputs(batch, last_.rewards.size(), last_.observations.size(), last_.info.size());
    const Unlocked unlocked(mutex_);
    pool_.step(input.data(), input.size(), last_.batch());
    last_.copy_to(outputs);
    newest_ = &last_;
  }

  /// Of some, a row for each in their order.
  void step_some(py::handle actions, const std::vector<std::uint32_t>& environments,
                 const py::sequence& batch) {
    const Specification& specification = pool_.specification();
    const std::size_t count = environments.size();
    const Input input(actions, "actions", count * specification.action_size());
    StepOutputs outputs(batch, count, count * specification.observation_size(),
                        count * specification.info_names.size());
    const Unlocked unlocked(mutex_);
    if (some_.rewards.size() != count) {
      newest_ = &last_;
      some_ = Rows(specification, count);
    }
    pool_.step(input.data(), environments.data(), count, some_.batch());
    some_.copy_to(outputs);
    newest_ = &some_;
    remember(some_, environments);
  }

  /// same_step: of the episodes that ended in the newest step or `recv`, in the order of its
  /// rows; other rows are of no meaning.
  void final_rows(py::handle observations, py::handle info) {
    const Rows& rows = *newest_;
    Output observations_output(observations, "observations", rows.final_observations.size());
    Output info_output(info, "info", rows.final_info.size());
    const Unlocked unlocked(mutex_);
    observations_output.take(rows.final_observations.data());
    info_output.take(rows.final_info.data());
  }

  void send(py::handle actions, const std::vector<std::uint32_t>& environments) {
    const Input input(actions, "actions");
    const std::size_t expected = environments.size() * pool_.specification().action_size();
    if (input.size() != expected) {
      throw py::value_error("actions has " + std::to_string(input.size()) + " values; must have " +
                            std::to_string(expected) + ", " + std::to_string(environments.size()) +
                            " environments of " +
                            std::to_string(pool_.specification().action_size()));
    }
    const Unlocked unlocked(mutex_);
    pool_.send(input.data(), environments.data(), environments.size());
  }

  void send_resets(const std::vector<std::uint32_t>& environments) {
    const Unlocked unlocked(mutex_);
    pool_.send_resets(environments);
  }

  /// @return whose rows these are
  std::vector<std::uint32_t> recv(const py::sequence& batch) {
    StepOutputs outputs(batch, arrived_.rewards.size(), arrived_.observations.size(),
                        arrived_.info.size());
    const Unlocked unlocked(mutex_);
    pool_.recv(arrived_.batch(), arrived_environments_.data());
    arrived_.copy_to(outputs);
    newest_ = &arrived_;
    remember(arrived_, arrived_environments_);
    return arrived_environments_;
  }

  /// Of these, each as Environment.get_state gives it.
  py::list get_states(const std::vector<std::uint32_t>& environments) {
    std::vector<std::vector<std::byte>> states(environments.size());
    {
      const Unlocked unlocked(mutex_);
      for (std::size_t i = 0; i < states.size(); ++i) pool_.save_state(environments[i], states[i]);
    }
    py::list list;
    for (const std::vector<std::byte>& state : states) {
      list.append(py::bytes(reinterpret_cast<const char*>(state.data()), state.size()));
    }
    return list;
  }

  /// @throws ValueError naming the environment and what is wrong; then nothing has changed
  void set_states(const std::vector<std::uint32_t>& environments, const py::sequence& given) {
    std::vector<std::vector<std::byte>> states;
    for (const py::handle state : given) states.push_back(to_state_bytes(state));
    if (environments.empty() && states.empty()) return;
    const Unlocked unlocked(mutex_);
    pool_.load_states(environments, states, last_.batch());
  }

  /// For pickle and copy.
  py::tuple stored() {
    std::vector<std::uint32_t> all(asked_.num_envs);
    std::iota(all.begin(), all.end(), 0U);
    return py::make_tuple(id_, parameters_, asked_.num_envs, asked_.num_threads,
                          to_text(asked_.autoreset_mode), asked_.batch_size, get_states(all));
  }

  static std::unique_ptr<VectorWalkers> from_stored(const py::tuple& stored) {
    constexpr std::size_t kFields = 7;
    if (stored.size() != kFields) throw py::value_error("this is no stored pool");
    auto walkers = std::make_unique<VectorWalkers>(
        stored[0].cast<std::string>(), stored[1].cast<py::dict>(), stored[2].cast<std::size_t>(),
        stored[3].cast<std::size_t>(), stored[4].cast<std::string>(),
        stored[5].cast<std::size_t>());
    walkers->set_states({}, stored[6].cast<py::list>());
    return walkers;
  }

  /// As Environment.capture, of one of them.
  StateCapture capture(std::size_t index) {
    StateCapture captured;
    const Unlocked unlocked(mutex_);
    Environment& environment = pool_.environment(index);
    walker::capture(environment, last_.steps[index], captured);
    return captured;
  }

  std::string error(std::size_t index) {
    const Unlocked unlocked(mutex_);
    return pool_.error(index);
  }

  std::string reset_error(std::size_t index) {
    const Unlocked unlocked(mutex_);
    return pool_.reset_error(index);
  }

  GeneratorState generator_state(std::size_t index) {
    const Unlocked unlocked(mutex_);
    return pool_.environment(index).generator_state();
  }

  void set_generator_states(const std::vector<std::uint32_t>& environments,
                            const std::vector<GeneratorState>& states) {
    if (states.size() != environments.size()) {
      throw py::value_error(std::to_string(states.size()) + " states; must be " +
                            std::to_string(environments.size()) + " as the environments");
    }
    const Unlocked unlocked(mutex_);
    for (const std::uint32_t index : environments) pool_.environment(index);  // throws first
    for (std::size_t i = 0; i < states.size(); ++i) {
      pool_.environment(environments[i]).set_generator_state(states[i]);
    }
  }

 private:
  /// Puts rows of some environments where those of all are.
  void remember(const Rows& rows, const std::vector<std::uint32_t>& environments) {
    const std::size_t width = pool_.specification().observation_size();
    for (std::size_t row = 0; row < environments.size(); ++row) {
      const std::size_t index = environments[row];
      std::copy_n(rows.observations.data() + row * width, width,
                  last_.observations.data() + index * width);
      last_.steps[index] = rows.steps[row];
    }
  }

  std::string id_;
  Parameters parameters_;
  PoolOptions asked_;
  Pool pool_;
  std::mutex mutex_;
  Rows last_;
  Rows arrived_;
  std::vector<std::uint32_t> arrived_environments_;
  Rows some_;                    // of those that `step_some` stepped
  const Rows* newest_ = &last_;  // of the three
};

/// Rows of info turned into columns: what is NaN becomes 0, and its mask false. One call, for after
/// a step of many worlds NumPy's code is no longer in the processor's caches.
/// @return for each column whether any row has it
std::vector<bool> info_columns(py::handle info, std::size_t num_columns, py::handle values,
                               py::handle masks) {
  const Input rows(info, "info");
  Output values_output(values, "values", rows.size());
  FlagOutput masks_output(masks, "masks", rows.size());
  const std::size_t num_rows = rows.size() / num_columns;
  std::vector<double> columns(rows.size());
  std::vector<std::uint8_t> is_there(rows.size());
  std::vector<bool> is_anywhere(num_columns);
  for (std::size_t column = 0; column < num_columns; ++column) {
    for (std::size_t row = 0; row < num_rows; ++row) {
      const double value = rows.data()[row * num_columns + column];
      if (std::isnan(value)) continue;
      columns[column * num_rows + row] = value;
      is_there[column * num_rows + row] = 1;
      is_anywhere[column] = true;
    }
  }
  values_output.take(columns.data());
  masks_output.take(is_there.data());
  return is_anywhere;
}

}  // namespace

void bind_pool(py::module& module) {
  module.def("info_columns", &info_columns);
  py::class_<VectorWalkers>(module, "Pool")
      .def(py::init<const std::string&, const py::dict&, std::size_t, std::size_t,
                    const std::string&, std::size_t>(),
           py::arg("id"), py::arg("parameters"), py::arg("num_envs"), py::arg("num_threads"),
           py::arg("autoreset_mode"), py::arg("batch_size"))
      .def_property_readonly("specification", &VectorWalkers::specification)
      .def_property_readonly("num_threads", &VectorWalkers::num_threads)
      .def_property_readonly("batch_size", &VectorWalkers::batch_size)
      .def("reset", &VectorWalkers::reset)
      .def("step_batch", &VectorWalkers::step)
      .def("step_some", &VectorWalkers::step_some)
      .def("final_rows", &VectorWalkers::final_rows)
      .def("send", &VectorWalkers::send)
      .def("send_resets", &VectorWalkers::send_resets)
      .def("recv", &VectorWalkers::recv)
      .def("capture", &VectorWalkers::capture)
      .def("error", &VectorWalkers::error)
      .def("reset_error", &VectorWalkers::reset_error)
      .def("generator_state", &VectorWalkers::generator_state)
      .def("set_generator_states", &VectorWalkers::set_generator_states)
      .def("get_states", &VectorWalkers::get_states)
      .def("set_states", &VectorWalkers::set_states)
      .def(py::pickle([](VectorWalkers& walkers) { return walkers.stored(); },
                      &VectorWalkers::from_stored));
}

}  // namespace walker::python
