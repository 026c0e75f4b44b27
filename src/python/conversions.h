// Conversion of parameters, specifications, saved states and seeds between Python and the core.
#pragma once

#include <pybind11/pybind11.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "walker_sim/client.h"
#include "walker_sim/environment.h"
#include "walker_sim/parameters.h"
#include "walker_sim/specification.h"

namespace walker::python {

/// Returns the value's repr for a message: on one line, a long one without its middle.
std::string shown(const pybind11::handle& value);

/// Decodes UTF-8 that another process may have written: invalid bytes become U+FFFD.
pybind11::str to_str(const std::string& text);

/// Converts keyword arguments: bool, int, float, str, paths, sequences of numbers, and NumPy's
/// equivalents.
/// @throws TypeError naming a parameter of another type; ValueError for a number out of a float's
///         range or a text with surrogates, which UTF-8 cannot encode
Parameters to_parameters(const pybind11::dict& given);

/// Copies a saved state.
/// @throws TypeError if it is not bytes
std::vector<std::byte> to_state_bytes(const pybind11::handle& state);

template <typename Byte>
pybind11::bytes to_bytes(const std::vector<Byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Specification under the names of EnvironmentSpec.msg; `parameters` maps names to texts.
pybind11::dict to_dict(const Specification& specification);

/// A server's specification under the same names, plus num_envs, mode and autoreset_mode.
pybind11::dict to_dict(const ServerSpecification& specification);

/// Converts seeds, one per environment. None: the environment's generator continues.
/// @throws ValueError naming a seed that is not an integer from 0 to 2^64 - 1
std::optional<std::uint64_t> to_seed(const pybind11::object& value);
std::vector<std::optional<std::uint64_t>> to_seeds(const pybind11::sequence& values);

}  // namespace walker::python
