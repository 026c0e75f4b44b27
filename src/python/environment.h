// One walker in this process, as Python sees it.
#pragma once

#include <pybind11/pybind11.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "walker_sim/environment.h"
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
  Instant look();

  /// For pickle and copy: how to come to the present state.
  /// @throws ValueError where the episode depends on those before it, or is too long
  pybind11::tuple state() const;

  /// @throws ValueError where another version stored it, or the episode comes out differently
  static std::unique_ptr<RecordedEnvironment> from_state(const pybind11::tuple& state);

 private:
  /// What leads to the present state.
  struct Episode {
    bool has_begun = false;
    GeneratorState generator_state{};  ///< before the reset
    std::vector<double> actions;       ///< since the reset
    std::uint32_t num_steps = 0;       ///< since the reset
    bool is_too_long = false;          ///< the actions have been given up
  };

  void begin(const GeneratorState& generator_state);
  void advance(const double* action, std::size_t size, Result& result);

  std::string id_;
  Parameters parameters_;
  std::unique_ptr<Environment> environment_;
  mutable std::mutex mutex_;
  std::vector<double> observation_;  // the last
  std::vector<double> info_;
  Episode episode_;
};

/// Adds the class to the module.
void bind_environment(pybind11::module& module);

}  // namespace walker::python
