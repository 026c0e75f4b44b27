// NumPy's arrays through the buffer protocol, which every version of NumPy speaks alike.
#pragma once

#include <pybind11/pybind11.h>

#include <cstddef>
#include <cstdint>

namespace walker::python {

/// A C-contiguous array of the caller's, held while this lives. Its memory may be used without the
/// interpreter's lock.
class Array {
 public:
  /// @param name    of the argument, for errors
  /// @param formats allowed types of elements, a letter each as the module struct has them
  /// @throws TypeError where the object is no such array
  Array(pybind11::handle object, const char* name, const char* formats, bool is_written);
  Array(const Array&) = delete;
  Array& operator=(const Array&) = delete;
  ~Array() { PyBuffer_Release(&view_); }

  std::size_t size() const { return static_cast<std::size_t>(view_.len / view_.itemsize); }
  char format() const { return *view_.format; }
  void* data() const { return view_.buf; }

 private:
  Py_buffer view_{};
};

/// float64 values to be read.
class Input {
 public:
  /// @throws TypeError
  Input(pybind11::handle object, const char* name) : array_(object, name, "d", false) {}

  const double* data() const { return static_cast<const double*>(array_.data()); }
  std::size_t size() const { return array_.size(); }

 private:
  Array array_;
};

/// Takes results: float64 or float32, the latter to the nearest.
class Output {
 public:
  /// @param size elements that it must have
  /// @throws TypeError, ValueError naming the argument
  Output(pybind11::handle object, const char* name, std::size_t size);
  /// Of any size. @throws TypeError
  Output(pybind11::handle object, const char* name) : array_(object, name, "fd", true) {}

  std::size_t size() const { return array_.size(); }
  /// @param values `size()` ones
  void take(const double* values);

 private:
  Array array_;
};

/// Takes values of one type as they are.
template <typename Value, char kFormat>
class ExactOutput {
 public:
  /// @throws as Output
  ExactOutput(pybind11::handle object, const char* name, std::size_t size);
  ExactOutput(pybind11::handle object, const char* name) : array_(object, name, kFormats, true) {}

  std::size_t size() const { return array_.size(); }
  /// @param values `size()` ones
  void take(const Value* values);

 private:
  static constexpr char kFormats[] = {kFormat, '\0'};

  Array array_;
};

using FlagOutput = ExactOutput<std::uint8_t, '?'>;  ///< one byte each
using ColorOutput = ExactOutput<std::uint8_t, 'B'>;
using DepthOutput = ExactOutput<float, 'f'>;

}  // namespace walker::python
