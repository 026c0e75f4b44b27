#include "python/arrays.h"

#include <cstring>
#include <string>

namespace walker::python {
namespace py = pybind11;
namespace {

const char* type_name(char format) {
  switch (format) {
    case 'd':
      return "float64";
    case 'f':
      return "float32";
    case 'B':
      return "uint8";
    default:
      return "bool";
  }
}

std::string type_names(const char* formats) {
  std::string names;
  for (const char* format = formats; *format != '\0'; ++format) {
    if (!names.empty()) names += " or ";
    names += type_name(*format);
  }
  return names;
}

}  // namespace

Array::Array(py::handle object, const char* name, const char* formats, bool is_written,
             std::optional<std::size_t> size)
    : Array(object, name, formats, is_written) {
  if (size) check_size(*size);
}

Array::Array(py::handle object, const char* name, const char* formats, bool is_written)
    : name_(name) {
  const int wanted = PyBUF_C_CONTIGUOUS | PyBUF_FORMAT | (is_written ? PyBUF_WRITABLE : 0);
  const bool has_buffer = PyObject_GetBuffer(object.ptr(), &view_, wanted) == 0;
  if (has_buffer && std::strlen(view_.format) == 1 &&
      std::strchr(formats, *view_.format) != nullptr) {
    return;
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

void Array::check_size(std::size_t expected) const {
  if (size() == expected) return;
  throw py::value_error(std::string(name_) + " has " + std::to_string(size()) +
                        " values; must have " + std::to_string(expected));
}

void Output::take(const double* values) {
  if (format() == 'd') {
    std::copy_n(values, size(), static_cast<double*>(memory()));
    return;
  }
  auto* singles = static_cast<float*>(memory());
  for (std::size_t i = 0; i < size(); ++i) singles[i] = static_cast<float>(values[i]);
}

}  // namespace walker::python
