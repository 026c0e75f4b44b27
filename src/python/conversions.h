// Conversion of arguments and results between Python and the core. NumPy arrays come through the
// buffer protocol, which is the same in every version of NumPy.
#pragma once

#include <pybind11/pybind11.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "walker_sim/client.h"
#include "walker_sim/environment.h"
#include "walker_sim/parameters.h"
#include "walker_sim/specification.h"
#include "walker_sim/world.h"

namespace walker::python {

/// Holds the buffer of a caller's C-contiguous array. Its memory may be used without the GIL.
class Array {
 public:
  /// @param name    of the argument, for error messages
  /// @param formats allowed element types, one format character of the module struct each
  /// @param size    required number of elements; none: any number
  /// @throws TypeError if the object is not such an array, ValueError if it has another size
  Array(pybind11::handle object, const char* name, const char* formats, bool is_written,
        std::optional<std::size_t> size);
  Array(const Array&) = delete;
  Array& operator=(const Array&) = delete;
  ~Array() { PyBuffer_Release(&view_); }

  const char* name() const { return name_; }
  std::size_t size() const { return static_cast<std::size_t>(view_.len / view_.itemsize); }

 protected:
  char format() const { return *format_; }
  void* memory() const { return view_.buf; }

 private:
  const char* name_;
  const char* format_ = "";
  Py_buffer view_{};
};

/// float64 or float32 values to read. Aligned float64 arrays are read in place, others are copied.
class Input : public Array {
 public:
  Input(pybind11::handle object, const char* name, std::optional<std::size_t> size = std::nullopt);

  const double* data() const { return data_; }
  std::vector<double> to_vector() const { return {data(), data() + size()}; }

 private:
  std::vector<double> copied_;  // float32 or unaligned values
  const double* data_;
};

/// Receives results as float64, or as float32 rounded to nearest.
class Output : public Array {
 public:
  Output(pybind11::handle object, const char* name, std::optional<std::size_t> size = std::nullopt)
      : Array(object, name, "fd", true, size) {}

  /// @param values `size()` values
  void write(const double* values) { write(values, 0, size()); }
  /// Receives a row of a matrix with `values.size()` columns.
  void write_row(std::size_t row, const std::vector<double>& values) {
    write(values.data(), row * values.size(), values.size());
  }
  /// The array's memory if its elements have that type, else null.
  double* doubles() const { return format() == 'd' ? static_cast<double*>(memory()) : nullptr; }
  float* singles() const { return format() == 'f' ? static_cast<float*>(memory()) : nullptr; }

 private:
  void write(const double* values, std::size_t begin, std::size_t count);
};

/// Receives values of one type without conversion.
template <typename Value, char kFormat>
class ExactOutput : public Array {
 public:
  ExactOutput(pybind11::handle object, const char* name,
              std::optional<std::size_t> size = std::nullopt)
      : Array(object, name, kFormats, true, size) {}

  /// @param values `size()` values
  void write(const Value* values) { std::copy_n(values, size(), data()); }
  Value* data() { return static_cast<Value*>(memory()); }

 private:
  static constexpr char kFormats[] = {kFormat, '\0'};
};

using NumberOutput = ExactOutput<double, 'd'>;
using FlagOutput = ExactOutput<std::uint8_t, '?'>;  ///< one byte per flag
using ColorOutput = ExactOutput<std::uint8_t, 'B'>;
using DepthOutput = ExactOutput<float, 'f'>;

/// Returns the output; none if the object is None.
template <typename Any>
std::optional<Any> to_output(const pybind11::object& object, const char* name,
                             std::optional<std::size_t> size = std::nullopt) {
  if (object.is_none()) return std::optional<Any>();
  return std::optional<Any>(std::in_place, object, name, size);
}

/// The arrays of walker_sim.walkers.Batch, one row per environment.
struct StepOutputs {
  using Size = std::optional<std::size_t>;
  explicit StepOutputs(const pybind11::sequence& batch, Size rows = {}, Size observed = {},
                       Size infos = {})
      : observations(batch[0], "observations", observed),
        rewards(batch[1], "rewards", rows),
        terminated(batch[2], "terminated", rows),
        truncated(batch[3], "truncated", rows),
        info(batch[4], "info", infos) {}

  Output observations;
  NumberOutput rewards;
  FlagOutput terminated;
  FlagOutput truncated;
  NumberOutput info;
};

/// Returns the value's repr for a message: on one line, a long one without its middle.
std::string shown(const pybind11::handle& value);

/// Decodes a text that may not be UTF-8, e.g. a file name: invalid bytes become U+FFFD.
pybind11::str to_str(const std::string& text);

/// Converts keyword arguments: bool, int, float, str, paths, sequences of numbers, and NumPy's
/// equivalents.
/// @throws TypeError naming a parameter of another type; ValueError for a number out of a float's
///         range or a text with surrogates, which UTF-8 cannot encode
Parameters to_parameters(const pybind11::dict& given);

/// Converts a mapping of names to pairs (low, high).
/// @throws TypeError if a name is not a text or a range not a pair of floats, ValueError for a name
///         with surrogates
World to_world(const pybind11::dict& given);
/// @param given mappings
std::vector<World> to_worlds(const pybind11::sequence& given);

/// Returns pairs (low, high) by name.
pybind11::dict to_dict(const World& world);

/// As `to_dict`, with numbers in place of ranges that are numbers.
pybind11::dict to_drawn(const World& drawn);
pybind11::list to_drawn(const std::vector<World>& drawn);
pybind11::dict to_drawn(const std::map<std::size_t, World>& drawn);

/// Returns a method for Python that returns what the worlds of `method` have drawn.
template <typename Binding, typename Result, typename Argument>
auto drawn_by(Result (Binding::*method)(Argument)) {
  return [method](Binding& self, Argument environments) {
    return to_drawn((self.*method)(environments));
  };
}

/// Copies a saved state.
/// @throws TypeError if it is not bytes
std::vector<std::byte> to_state_bytes(const pybind11::handle& state);

template <typename Byte>
pybind11::bytes to_bytes(const std::vector<Byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Specification under the names of EnvironmentSpec.msg; `parameters` maps names to texts.
pybind11::dict to_dict(const Specification& specification);

/// What a client compares or reports, under the same names; `world` has a tuple (low, high) per
/// parameter.
pybind11::dict to_dict(const ServerSpecification& specification);

/// Converts seeds, one per environment. None: the environment's generator continues.
/// @throws ValueError naming a seed that is not an integer from 0 to 2^64 - 1
std::optional<std::uint64_t> to_seed(const pybind11::object& value);
std::vector<std::optional<std::uint64_t>> to_seeds(const pybind11::sequence& values);

}  // namespace walker::python
