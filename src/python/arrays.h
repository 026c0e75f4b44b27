// NumPy's arrays through the buffer protocol, which every version of NumPy speaks alike.
#pragma once

#include <pybind11/pybind11.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace walker::python {

/// A C-contiguous array of the caller's, held while this lives. Its memory may be used without the
/// interpreter's lock.
class Array {
 public:
  /// @param name    of the argument, for errors
  /// @param formats allowed types of elements, a letter each as the module struct has them
  /// @param size    elements that it must have; none: any number
  /// @throws TypeError where the object is no such array, ValueError where it has another size
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

/// float64 or float32 values to be read; the former are read where they are, if they are aligned.
class Input : public Array {
 public:
  Input(pybind11::handle object, const char* name, std::optional<std::size_t> size = std::nullopt);

  const double* data() const { return data_; }

 private:
  std::vector<double> copied_;  // of float32 values, and of those that are not aligned
  const double* data_;
};

/// Takes results: float64 or float32, the latter to the nearest.
class Output : public Array {
 public:
  Output(pybind11::handle object, const char* name, std::optional<std::size_t> size = std::nullopt)
      : Array(object, name, "fd", true, size) {}

  /// @param values `size()` ones
  void take(const double* values) { take(values, 0, size()); }
  /// A row of an array of rows as long.
  void take_row(std::size_t row, const std::vector<double>& values) {
    take(values.data(), row * values.size(), values.size());
  }
  /// Its memory, if its values are of that type; else null.
  double* doubles() const { return format() == 'd' ? static_cast<double*>(memory()) : nullptr; }
  float* singles() const { return format() == 'f' ? static_cast<float*>(memory()) : nullptr; }

 private:
  void take(const double* values, std::size_t begin, std::size_t count);
};

/// Takes values of one type as they are.
template <typename Value, char kFormat>
class ExactOutput : public Array {
 public:
  ExactOutput(pybind11::handle object, const char* name,
              std::optional<std::size_t> size = std::nullopt)
      : Array(object, name, kFormats, true, size) {}

  /// @param values `size()` ones
  void take(const Value* values) { std::copy_n(values, size(), data()); }
  Value* data() { return static_cast<Value*>(memory()); }

 private:
  static constexpr char kFormats[] = {kFormat, '\0'};
};

using NumberOutput = ExactOutput<double, 'd'>;
using FlagOutput = ExactOutput<std::uint8_t, '?'>;  ///< one byte each
using ColorOutput = ExactOutput<std::uint8_t, 'B'>;
using DepthOutput = ExactOutput<float, 'f'>;

/// The arrays of walker_sim.transport.Batch, a row per environment.
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
