// Parameters, specifications and generator states between Python and the core.
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

/// As a message shows it: what its repr says, in one line that is not too long.
std::string shown(const pybind11::handle& value);

/// A text that another process may have written: what is not UTF-8 becomes U+FFFD.
pybind11::str to_str(const std::string& text);

/// Keyword arguments: bool, int, float, str, paths, sequences of numbers, and NumPy's own of these.
/// @throws TypeError naming a parameter of another type; ValueError for a number that no float has
///         room for, and a text that has no form in UTF-8
Parameters to_parameters(const pybind11::dict& given);

/// A state that was saved.
/// @throws TypeError for what is no bytes
std::vector<std::byte> to_state_bytes(const pybind11::handle& state);

/// What an environment is, by the names of EnvironmentSpec.msg; `parameters` holds texts by name.
pybind11::dict to_dict(const Specification& specification);

/// What a server says of itself, by the same names, with num_envs, mode and autoreset_mode on top.
pybind11::dict to_dict(const ServerSpecification& specification);

/// Seeds, one per environment; None: its generator continues.
/// @throws ValueError naming a seed that is not from 0 to 2^64 - 1
std::optional<std::uint64_t> to_seed(const pybind11::object& value);
std::vector<std::optional<std::uint64_t>> to_seeds(const pybind11::sequence& values);

}  // namespace walker::python
