// NumPy arrays through the buffer protocol, which is the same in every version of NumPy.
#pragma once

#include <pybind11/pybind11.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

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

/// The arrays of walker_sim.transport.Batch, one row per environment.
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

}  // namespace walker::python
