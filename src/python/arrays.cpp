#include "python/arrays.h"

#include <cstring>
#include <map>
#include <string>
#include <string_view>

namespace walker::python {
namespace py = pybind11;
namespace {

/// Joins the names of the types, e.g. "float32 or float64".
std::string type_names(std::string_view formats) {
  const std::map<char, const char*> names{
      {'?', "bool"}, {'B', "uint8"}, {'d', "float64"}, {'f', "float32"}};
  std::string text;
  for (const char format : formats)
    text += (text.empty() ? "" : " or ") + std::string(names.at(format));
  return text;
}

}  // namespace

Array::Array(py::handle object, const char* name, const char* formats, bool is_written,
             std::optional<std::size_t> size)
    : name_(name) {
  const int wanted = PyBUF_C_CONTIGUOUS | PyBUF_FORMAT | (is_written ? PyBUF_WRITABLE : 0);
  const bool has_buffer = PyObject_GetBuffer(object.ptr(), &view_, wanted) == 0;
  // NumPy marks an unaligned array with '=': native byte order and standard sizes, which equal the
  // native ones here.
  const bool is_unaligned = has_buffer && !is_written && *view_.format == '=';
  format_ = has_buffer ? view_.format + (is_unaligned ? 1 : 0) : "";
  if (std::strlen(format_) == 1 && std::strchr(formats, *format_) != nullptr) {
    if (!size || this->size() == *size) return;
    const std::string found = std::to_string(this->size());
    PyBuffer_Release(&view_);
    throw py::value_error(std::string(name_) + " has " + found + " values; must have " +
                          std::to_string(*size));
  }
  std::string message = std::string(name) + ": must be a C-contiguous array of " +
                        type_names(formats) + (is_written ? " that can be written" : "");
  if (has_buffer) {
    message += std::string("; its elements are of format ") + view_.format;
    PyBuffer_Release(&view_);
  } else {
    PyErr_Clear();
  }
  throw py::type_error(message);
}

Input::Input(py::handle object, const char* name, std::optional<std::size_t> size)
    : Array(object, name, "fd", false, size), data_(static_cast<const double*>(memory())) {
  const bool is_aligned = reinterpret_cast<std::uintptr_t>(memory()) % alignof(double) == 0;
  if (format() == 'd' && is_aligned) return;
  copied_.resize(this->size());
  if (format() == 'd') {
    std::memcpy(copied_.data(), memory(), copied_.size() * sizeof(double));
  } else {
    const auto* bytes = static_cast<const char*>(memory());
    for (double& value : copied_) {
      float single = 0;
      std::memcpy(&single, bytes, sizeof(single));
      value = double{single};
      bytes += sizeof(single);
    }
  }
  data_ = copied_.data();
}

void Output::write(const double* values, std::size_t begin, std::size_t count) {
  if (double* const to = doubles()) {
    std::copy_n(values, count, to + begin);
  } else {
    std::transform(values, values + count, singles() + begin,
                   [](double value) { return static_cast<float>(value); });
  }
}

}  // namespace walker::python
