// One walker in this process, as Python sees it.
#pragma once

#include <pybind11/pybind11.h>

#include <memory>
#include <mutex>
#include <string>

#include "core/episode_recorder.h"
#include "walker_sim/parameters.h"
#include "walker_sim/renderer.h"

namespace walker::python {

/// An environment that knows how its episode came about, so that it can be copied and stored. One
/// thread at a time is let in; the others wait without the interpreter's lock.
class RecordedEnvironment {
 public:
  /// @throws ValueError, TypeError as `make`
  RecordedEnvironment(std::string id, const pybind11::dict& parameters);

  pybind11::dict specification() const;

  /// Begins an episode from a generator's state.
  /// @return the generator's state afterwards
  pybind11::tuple reset(const pybind11::sequence& generator_state, pybind11::handle observation,
                        pybind11::handle info);

  /// @return reward, terminated, truncated, and the engine's error or an empty text
  pybind11::tuple step(pybind11::handle action, pybind11::handle observation,
                       pybind11::handle info);

  /// What a picture is drawn from.
  /// @throws ResetNeeded where there is no state to be seen
  StateCapture capture();

  /// For pickle and copy: how to come to the present state.
  /// @throws ValueError where the episode depends on those before it, or is too long
  pybind11::tuple state() const;

  /// @throws ValueError where another version stored it, or the episode comes out differently
  static std::unique_ptr<RecordedEnvironment> from_state(const pybind11::tuple& state);

 private:
  void begin(const GeneratorState& generator_state);

  std::string id_;
  Parameters parameters_;
  mutable std::mutex mutex_;
  EpisodeRecorder recorder_;
};

/// Adds the class to the module.
void bind_environment(pybind11::module& module);

}  // namespace walker::python
