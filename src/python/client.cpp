#include <pybind11/stl.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/checks.h"
#include "client/forks.h"
#include "episode/failure.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "python/conversions.h"
#include "walker_sim/client.h"
#include "walker_sim/environment.h"
#include "walker_sim/pool.h"
#include "walker_sim/registry.h"
#include "walker_sim/renderer.h"

namespace walker::python {
namespace py = pybind11;
namespace {

/// Whether Python has a signal to handle whose handler raises, as that of Ctrl-C does; the
/// exception is then set. Python handles signals in its main thread only.
bool raises_after_signal() {
  const Acquired acquired;
  return PyErr_CheckSignals() != 0;
}

/// Copies where the answer, which is as large as the server's specification says, is so for the
/// caller's array too; who has connected knows the size.
/// @throws ConnectionError
template <typename Values, typename Destination>
void take(const Values& values, Destination& destination) {
  if (values.size() != destination.size()) {
    throw ConnectionError("the server answers with " + std::to_string(values.size()) +
                          " values of " + destination.name() + " where " +
                          std::to_string(destination.size()) +
                          " were expected; has it been started again with other parameters?");
  }
  destination.take(values.data());
}

/// How far an episode is.
struct Place {
  std::uint32_t episode = 0;  ///< 0: not known
  std::uint32_t step = 0;
};

/// A step leads to the next place, or others' calls have come in between: then what came out is
/// right for nobody.
/// @throws ConnectionError
void check_follows(const Place& before, const Place& now) {
  const bool is_same_episode = before.episode == 0 || now.episode == before.episode;
  if (is_same_episode && now.step == before.step + 1) return;
  throw ConnectionError("the server answers with step " + std::to_string(now.step) +
                        " of episode " + std::to_string(now.episode) + " where step " +
                        std::to_string(before.step + 1) +
                        " was expected: somebody else has moved "
                        "the walker, or an earlier call that had failed; reset first");
}

/// A server's calls, filling arrays of the caller's. One thread at a time is let in. What the core
/// would refuse in process is refused here, in the same words, before it is sent.
class RemoteWalkers {
 public:
  /// @param id, parameters whose actions the server should take; both are to be compared
  RemoteWalkers(const std::string& id, const py::dict& parameters, std::string server,
                std::string master_uri, double timeout)
      : specification_(make(id, to_parameters(parameters))->specification()) {
    const ClientOptions options{std::move(server), std::move(master_uri), timeout,
                                &raises_after_signal, /*caller=*/{}};
    call([&] {
      client_.emplace(options);
      server_ = client_->specification();
    });
    notes_.resize(server_.num_envs);
  }

  /// What is wanted.
  py::dict specification() const { return to_dict(specification_); }
  /// What is there.
  py::dict server_specification() const { return to_dict(server_); }
  /// A call came to no end, or to an unexpected one, so the server may be another one now.
  /// So it is for the child of a fork, whose parent's it is.
  bool is_lost() const { return is_lost_ || is_forked(); }

  void reset(const py::object& seed, py::handle observation, py::handle info) {
    const auto number = to_seed(seed);
    Output observations(observation, "observation");
    Output infos(info, "info");
    call([&] {
      client_->reset(number, transition_);
      take(transition_.observation, observations);
      take(transition_.info, infos);
    });
  }

  /// @return as Environment.step
  py::tuple step(py::handle action, py::handle observation, py::handle info) {
    const Input actions(action, "action");
    Output observations(observation, "observation");
    Output infos(info, "info");
    const auto [reward, terminated, truncated, error] = call([&] {
      check_step(actions);
      const Place before{transition_.episode, transition_.step};
      client_->step(actions.data(), actions.size(), transition_);
      check_follows(before, {transition_.episode, transition_.step});
      take(transition_.observation, observations);
      take(transition_.info, infos);
      return std::make_tuple(transition_.reward, transition_.terminated, transition_.truncated,
                             transition_.error);
    });
    return py::make_tuple(reward, terminated, truncated, to_str(error));
  }

  /// The present episode as a record, of which nothing is known here.
  py::bytes snapshot() {
    std::vector<std::uint8_t> record;
    ask([&] {
      if (is_lost_) throw ResetNeeded(std::string("get_state: ") + kLost);
      if (transition_.episode == 0) {
        throw ResetNeeded("get_state: there is no episode yet; reset first");
      }
      client_->snapshot(record);
    });
    return {reinterpret_cast<const char*>(record.data()), record.size()};
  }

  void restore(const py::handle& record) {
    const std::vector<std::byte> bytes = to_state_bytes(record);
    std::vector<std::uint8_t> numbers(bytes.size());
    std::transform(bytes.begin(), bytes.end(), numbers.begin(),
                   [](std::byte byte) { return std::to_integer<std::uint8_t>(byte); });
    ask([&] { client_->restore(numbers, transition_); });
    is_lost_ = false;
  }

  /// Rows in the order of `environments`; empty: of all.
  void reset_batch(const std::vector<std::uint32_t>& environments, const py::sequence& seeds,
                   py::handle observations, py::handle info) {
    const auto numbers = to_seeds(seeds);
    Output observations_output(observations, "observations");
    Output info_output(info, "info");
    call([&] {
      for (const std::uint32_t environment : environments) check_index(environment);
      client_->reset_batch(environments, numbers, reset_);
      take(reset_.observations, observations_output);
      take(reset_.info, info_output);
      if (environments.empty()) std::for_each(notes_.begin(), notes_.end(), &Note::begin);
      for (const std::uint32_t environment : environments) Note::begin(notes_[environment]);
      note_failures(reset_.status_message);
    });
  }

  /// As Pool.error and Pool.reset_error.
  std::string error(std::size_t index) { return text_of(index, &Note::error); }
  std::string reset_error(std::size_t index) { return text_of(index, &Note::reset_error); }

  void step_batch(py::handle actions, const py::sequence& batch) {
    const Input input(actions, "actions");
    StepOutputs outputs(batch);
    call([&] {
      check_steps(input);
      client_->step_batch(input.data(), input.size(), batch_);
      note_places();
      take(batch_.observations, outputs.observations);
      take(batch_.rewards, outputs.rewards);
      take(batch_.terminated, outputs.terminated);
      take(batch_.truncated, outputs.truncated);
      take(batch_.info, outputs.info);
      note_ends();
      note_failures(batch_.status_message);
    });
  }

  /// A picture of one environment, as Renderer.render. A failure says nothing of the episode.
  void render(std::uint32_t environment, const py::dict& camera_parameters, const py::object& rgb,
              const py::object& depth) {
    const Parameters camera = to_parameters(camera_parameters);
    std::optional<ColorOutput> colors;
    std::optional<DepthOutput> depths;
    if (!rgb.is_none()) colors.emplace(rgb, "rgb");
    if (!depth.is_none()) depths.emplace(depth, "depth");
    try {
      const Unlocked unlocked = enter();
      check_look(environment);
      if (colors) {
        client_->render(environment, "rgb8", camera, image_);
        take(image_.rgb, *colors);
      }
      if (depths) {
        client_->render(environment, "32FC1", camera, image_);
        take(image_.depth, *depths);
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
      take(scattered(batch_.final_observations, server_.observation_size), observations_output);
      take(scattered(batch_.final_info, server_.info_names.size()), info_output);
    });
  }

 private:
  bool is_forked() const { return num_forks() != num_forks_; }

  /// @throws ConnectionError in the child of a fork, where nobody may be left to unlock the mutex
  Unlocked enter() {
    if (is_forked()) throw ConnectionError(kForked);
    return Unlocked(mutex_);
  }

  /// What is known of an environment that is stepped with the others.
  struct Note {
    bool has_begun = false;
    std::uint32_t ended_after = 0;  ///< steps; 0: it goes on, or the server resets it
    std::string error;              ///< of the last ~step_batch
    std::string reset_error;        ///< of its last reset
    Place place;

    static void begin(Note& note) { note = {true, 0, note.error, "", {}}; }
  };

  /// Without the interpreter's lock.
  /// @return what `made` returns
  /// @throws what `made` throws; what a signal's handler has raised
  template <typename Made>
  std::invoke_result_t<Made> call(const Made& made) {
    try {
      const Unlocked unlocked = enter();
      return made();
    } catch (const ConnectionError&) {
      is_lost_ = true;
      throw;
    } catch (const RequestRefused&) {
      is_lost_ = true;  // by what is known here it should have been made
      throw;
    } catch (const Interrupted&) {
      is_lost_ = true;
      throw py::error_already_set();
    }
  }

  /// As `call`, where a refusal says nothing of the episode.
  template <typename Made>
  void ask(const Made& made) {
    try {
      const Unlocked unlocked = enter();
      made();
    } catch (const ConnectionError&) {
      is_lost_ = true;
      throw;
    } catch (const Interrupted&) {
      is_lost_ = true;
      throw py::error_already_set();
    }
  }

  void check_index(std::uint32_t environment) const {
    if (environment < notes_.size()) return;
    throw py::index_error("environment " + std::to_string(environment) + ": must be in [0, " +
                          std::to_string(notes_.size() - 1) + "]");
  }

  /// What is there may be somebody else's episode, so one of this client's own is asked for.
  void check_look(std::uint32_t environment) const {
    check_index(environment);
    if (is_lost_) throw ResetNeeded(std::string("render: ") + kLost);
    if (transition_.episode == 0 && !notes_[environment].has_begun) {
      throw ResetNeeded("render: there is no episode yet; reset first");
    }
  }

  void check_step(const Input& action) const {
    if (is_lost_) throw ResetNeeded(std::string("step: ") + kLost);
    if (transition_.episode == 0) {
      throw ResetNeeded("step: there is no episode yet; reset first");
    }
    if (!transition_.error.empty()) throw ResetNeeded("step: the simulation failed; reset first");
    if (transition_.terminated || transition_.truncated) {
      throw ResetNeeded("step: the episode ended after " + std::to_string(transition_.step) +
                        " steps; reset first");
    }
    check_action(specification_, action.data(), action.size());
  }

  void check_steps(const Input& actions) const {
    if (is_lost_) throw ResetNeeded(std::string("step: ") + kLost);
    check_actions_size(specification_, actions.size(), notes_.size());
    for (std::size_t i = 0; i < notes_.size(); ++i) {
      check_action_of(i, specification_, actions.data() + i * specification_.action_size());
      need_episode(i);
    }
  }

  void need_episode(std::size_t environment) const {
    const Note& note = notes_[environment];
    if (note.has_begun && note.ended_after == 0 && !wants_reset(note)) return;
    const std::string whose = "environment " + std::to_string(environment) + ": ";
    if (!note.has_begun) throw ResetNeeded(whose + "there is no episode yet; reset first");
    if (wants_reset(note)) throw ResetNeeded(whose + kResetFailed + "; reset first");
    throw ResetNeeded(whose + "the episode ended after " + std::to_string(note.ended_after) +
                      " steps; reset first");
  }

  /// The engine refused to begin its episode, and nobody but the caller tries again.
  bool wants_reset(const Note& note) const { return !note.reset_error.empty() && !has_autoreset(); }

  bool has_autoreset() const { return server_.autoreset_mode != to_text(AutoresetMode::disabled); }

  /// @param message lines such as "environment 3: the simulation failed: MuJoCo: Stack overflow"
  void note_failures(const std::string& message) {
    constexpr std::string_view kEnvironment = "environment ";
    const std::string at_reset = ": " + std::string(kResetFailed) + ": ";
    const std::string in_step = ": " + std::string(kStepFailed) + ": ";
    std::istringstream lines(message);
    std::string line;
    while (std::getline(lines, line)) {
      if (line.rfind(kEnvironment, 0) != 0) continue;
      const std::string_view rest = std::string_view(line).substr(kEnvironment.size());
      std::size_t index = 0;
      const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), index);
      if (error != std::errc() || index >= notes_.size()) continue;
      const std::string words(end, rest.data() + rest.size());
      if (words.rfind(at_reset, 0) == 0) {
        notes_[index].reset_error = words.substr(at_reset.size());
      } else if (words.rfind(in_step, 0) == 0) {
        notes_[index].error = words.substr(in_step.size());
      }
    }
  }

  std::string text_of(std::size_t index, std::string Note::*text) {
    const Unlocked unlocked = enter();
    return notes_.at(index).*text;
  }

  /// Where all are now. What the server has reset may be anywhere before.
  void note_places() {
    for (std::size_t i = 0; i < notes_.size(); ++i) {
      const Place now{batch_.episodes[i], batch_.steps[i]};
      if (now.step != 0) check_follows(notes_[i].place, now);
      notes_[i].place = now;
    }
  }

  /// Of those episodes that nobody but the caller resets; and forgets the errors of before.
  void note_ends() {
    for (std::size_t i = 0; i < notes_.size(); ++i) {
      notes_[i].error.clear();
      notes_[i].reset_error.clear();
      const bool has_ended = batch_.terminated[i] != 0 || batch_.truncated[i] != 0;
      if (has_ended && !has_autoreset()) notes_[i].ended_after = batch_.steps[i];
    }
  }

  /// Rows of the environments that have just ended, among rows of zeros for all.
  /// @param width as the server's specification has it, by which the client has checked the rows
  std::vector<double> scattered(const std::vector<double>& rows, std::size_t width) const {
    std::vector<double> all(notes_.size() * width);
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
  std::mutex mutex_;
  unsigned num_forks_ = num_forks();
  std::atomic<bool> is_lost_{false};
  Transition transition_;    // of ~reset and ~step
  std::vector<Note> notes_;  // of ~reset_batch and ~step_batch, one per environment
  BatchReset reset_;
  BatchTransition batch_;
  Image image_;
};

}  // namespace

void bind_client(py::module& module) {
  py::class_<RemoteWalkers>(module, "Client")
      .def(py::init<const std::string&, const py::dict&, std::string, std::string, double>(),
           py::arg("id"), py::arg("parameters"), py::arg("server"), py::arg("master_uri"),
           py::arg("timeout"))
      .def_property_readonly("specification", &RemoteWalkers::specification)
      .def_property_readonly("server_specification", &RemoteWalkers::server_specification)
      .def_property_readonly("is_lost", &RemoteWalkers::is_lost)
      .def("reset", &RemoteWalkers::reset)
      .def("step", &RemoteWalkers::step)
      .def("snapshot", &RemoteWalkers::snapshot)
      .def("restore", &RemoteWalkers::restore)
      .def("reset_batch", &RemoteWalkers::reset_batch)
      .def("step_batch", &RemoteWalkers::step_batch)
      .def("final_rows", &RemoteWalkers::final_rows)
      .def("error", &RemoteWalkers::error)
      .def("reset_error", &RemoteWalkers::reset_error)
      .def("render", &RemoteWalkers::render);
}

}  // namespace walker::python
