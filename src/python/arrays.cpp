#include "python/arrays.h"

#include <algorithm>
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

void check_size(const Array& array, const char* name, std::size_t size) {
  if (array.size() == size) return;
  throw py::value_error(std::string(name) + " has " + std::to_string(array.size()) +
                        " values; must have " + std::to_string(size));
}

}  // namespace

Array::Array(py::handle object, const char* name, const char* formats, bool is_written) {
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

Output::Output(py::handle object, const char* name, std::size_t size) : Output(object, name) {
  check_size(array_, name, size);
}

void Output::take(const double* values) {
  const std::size_t size = array_.size();
  if (array_.format() == 'd') {
    std::copy_n(values, size, static_cast<double*>(array_.data()));
    return;
  }
  auto* singles = static_cast<float*>(array_.data());
  for (std::size_t i = 0; i < size; ++i) singles[i] = static_cast<float>(values[i]);
}

template <typename Value, char kFormat>
ExactOutput<Value, kFormat>::ExactOutput(py::handle object, const char* name, std::size_t size)
    : ExactOutput(object, name) {
  check_size(array_, name, size);
}

template <typename Value, char kFormat>
void ExactOutput<Value, kFormat>::take(const Value* values) {
  std::copy_n(values, array_.size(), static_cast<Value*>(array_.data()));
}

template class ExactOutput<std::uint8_t, '?'>;
template class ExactOutput<std::uint8_t, 'B'>;
template class ExactOutput<float, 'f'>;

}  // namespace walker::python
