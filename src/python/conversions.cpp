#include "python/conversions.h"

#include <pybind11/stl.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "base/printable_text.h"
#include "episode/walker.h"
#include "walker_sim/registry.h"

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

[[noreturn]] void refuse(const std::string& name, const py::handle& value) {
  throw py::type_error("parameter " + printable(name) + " = " + shown(value) +
                       ": must be a bool, an int, a float, a str or a sequence of numbers");
}

/// `isinstance<py::str>` would also accept bytes before pybind11 2.7.
bool is_text(const py::handle& value) { return PyUnicode_Check(value.ptr()) != 0; }

/// Whether Python cannot print an integer: the time is quadratic in the digits, and since 3.9.14
/// Python refuses more than 4300 digits.
bool is_too_long(const py::handle& value) {
  constexpr int kMaxBits = 14284;  // 4300 decimal digits
  return PyLong_Check(value.ptr()) != 0 &&
         value.attr("bit_length")().cast<py::ssize_t>() > kMaxBits;
}

std::string to_text(const std::string& name, const py::handle& value) {
  py::ssize_t size = 0;
  const char* const text = PyUnicode_AsUTF8AndSize(value.ptr(), &size);
  if (text != nullptr) return {text, static_cast<std::size_t>(size)};
  PyErr_Clear();
  throw py::value_error("parameter " + name + " = " + shown(value) +
                        ": must be a text that UTF-8 can encode; no surrogates");
}

/// @param number an int, a float, or an object that converts to a float
/// @param value  the parameter's value, which is or contains the number
double to_number(const std::string& name, const py::handle& number, const py::handle& value) {
  const double converted = PyFloat_AsDouble(number.ptr());
  if (PyErr_Occurred() == nullptr) return converted;
  const bool is_too_large = PyErr_ExceptionMatches(PyExc_OverflowError) != 0;
  PyErr_Clear();
  if (!is_too_large) refuse(name, value);
  throw py::value_error("parameter " + name + " = " + shown(value) +
                        ": must be a number between -1.8e+308 and 1.8e+308, as a float is");
}

std::vector<double> to_numbers(const std::string& name, const py::handle& value) {
  constexpr std::size_t kMax = 1000;  // bounds an endless iterable
  const py::object real = py::module::import("numbers").attr("Real");
  std::vector<double> numbers;
  for (const py::handle element : value) {
    if (!py::isinstance(element, real) || numbers.size() == kMax) refuse(name, value);
    numbers.push_back(to_number(name, element, value));
  }
  return numbers;
}

ParameterValue to_integer(const std::string& name, const py::handle& value) {
  int overflow = 0;
  const std::int64_t number = PyLong_AsLongLongAndOverflow(value.ptr(), &overflow);
  if (overflow == 0) return number;
  return to_number(name, value, value);  // beyond 64 bits: the range check reports the bounds
}

ParameterValue to_value(const std::string& name, const py::handle& value) {
  if (is_text(value)) return to_text(name, value);
  // NumPy's scalars become Python's, its arrays become lists.
  if (py::hasattr(value, "tolist")) {
    const py::object plain = value.attr("tolist")();
    if (!py::hasattr(plain, "tolist")) return to_value(name, plain);
  }
  if (py::isinstance<py::bool_>(value)) return value.cast<bool>();
  if (py::isinstance<py::int_>(value)) return to_integer(name, value);
  if (py::isinstance<py::float_>(value)) return to_number(name, value, value);
  if (py::hasattr(value, "__fspath__")) {
    const py::object path = value.attr("__fspath__")();
    if (!is_text(path)) refuse(name, value);
    return to_text(name, path);
  }
  const bool is_bytes = PyBytes_Check(value.ptr()) != 0 || PyByteArray_Check(value.ptr()) != 0;
  if (is_bytes || !py::hasattr(value, "__iter__")) refuse(name, value);
  return to_numbers(name, value);
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

std::string shown(const py::handle& value) {
  PyObject* const text = is_too_long(value) ? nullptr : PyObject_Repr(value.ptr());
  PyObject* const bytes =
      text == nullptr ? nullptr : PyUnicode_AsEncodedString(text, "utf-8", "backslashreplace");
  Py_XDECREF(text);
  if (bytes == nullptr) {
    PyErr_Clear();
    return std::string("(of type ") + Py_TYPE(value.ptr())->tp_name + ", too long to be shown)";
  }
  const std::string lines = py::reinterpret_steal<py::bytes>(bytes);
  std::string line;  // without NumPy's line breaks and indentation
  for (const char c : lines) {
    const bool is_indent = c == ' ' && !line.empty() && line.back() == '\n';
    if (!is_indent) line += c;
  }
  std::replace(line.begin(), line.end(), '\n', ' ');
  return printable(line);
}

py::str to_str(const std::string& text) {
  PyObject* const decoded =
      PyUnicode_DecodeUTF8(text.data(), static_cast<py::ssize_t>(text.size()), "replace");
  if (decoded == nullptr) throw py::error_already_set();
  return py::reinterpret_steal<py::str>(decoded);
}

Parameters to_parameters(const py::dict& given) {
  Parameters parameters;
  for (const auto& [key, value] : given) {
    const std::string name = to_text("name", key);
    parameters[name] = to_value(name, value);
  }
  return parameters;
}

World to_world(const py::dict& given) {
  World world;
  for (const auto& [key, value] : given) {
    if (!is_text(key)) throw py::type_error("world parameter " + shown(key) + ": must be a str");
    const bool is_log_uniform = py::isinstance<py::dict>(value);
    const py::handle ends = is_log_uniform ? py::handle(value["log"]) : value;
    const auto [low, high] = ends.cast<std::pair<double, double>>();
    world[to_text("name", key)] = {low, high, is_log_uniform && low != high};
  }
  return world;
}

std::vector<World> to_worlds(const py::sequence& given) {
  std::vector<World> worlds;
  for (const py::handle world : given) worlds.push_back(to_world(world.cast<py::dict>()));
  return worlds;
}

py::dict to_dict(const World& world) {
  py::dict dict;
  for (const auto& [name, range] : world) {
    const py::tuple ends = py::make_tuple(range.low, range.high);
    dict[to_str(name)] =
        range.is_log_uniform ? py::object(py::dict(py::arg("log") = ends)) : py::object(ends);
  }
  return dict;
}

py::dict to_drawn(const World& drawn) {
  py::dict dict = to_dict(drawn);
  for (const auto& [name, range] : drawn) {
    if (range.is_number()) dict[to_str(name)] = range.low;
  }
  return dict;
}

py::list to_drawn(const std::vector<World>& drawn) {
  py::list list;
  for (const World& world : drawn) list.append(to_drawn(world));
  return list;
}

py::dict to_drawn(const std::map<std::size_t, World>& drawn) {
  py::dict dict;
  for (const auto& [row, world] : drawn) dict[py::int_(row)] = to_drawn(world);
  return dict;
}

std::vector<std::byte> to_state_bytes(const py::handle& state) {
  if (!py::isinstance<py::bytes>(state)) {
    throw py::type_error(std::string("a state is of type ") + Py_TYPE(state.ptr())->tp_name +
                         "; must be bytes, as get_state gives them");
  }
  char* begin = nullptr;
  py::ssize_t size = 0;
  if (PyBytes_AsStringAndSize(state.ptr(), &begin, &size) != 0) throw py::error_already_set();
  const auto* const bytes = reinterpret_cast<const std::byte*>(begin);
  return {bytes, bytes + size};
}

py::dict to_dict(const Specification& specification) {
  py::dict parameters;
  for (const auto& [name, text] : describe_origin(specification).parameters) {
    parameters[name.c_str()] = text;
  }
  py::list joints;
  for (const Joint& joint : specification.joints) joints.append(joint.name);
  py::dict dict;
  dict["id"] = specification.id;
  dict["parameters"] = parameters;
  dict["observation_dtype"] = specification.observation_dtype;
  dict["observation_low"] = specification.observation_low;
  dict["observation_high"] = specification.observation_high;
  dict["action_low"] = specification.action_low;
  dict["action_high"] = specification.action_high;
  dict["dt"] = specification.dt;
  dict["max_episode_steps"] = specification.max_episode_steps;
  dict["reward_threshold"] = specification.reward_threshold;
  dict["joint_names"] = joints;
  dict["info_names"] = specification.info_names;
  dict["engine"] = specification.engine;
  dict["engine_version"] = specification.engine_version;
  dict["engine_path"] = to_str(specification.engine_path);
  dict["version"] = version();
  return dict;
}

py::dict to_dict(const ServerSpecification& specification) {
  py::dict parameters;
  for (std::size_t i = 0; i < specification.parameter_names.size(); ++i) {
    parameters[py::str(specification.parameter_names[i])] = specification.parameter_values[i];
  }
  py::dict dict;
  dict["id"] = specification.id;
  dict["parameters"] = parameters;
  dict["num_envs"] = specification.num_envs;
  dict["mode"] = specification.mode;
  dict["autoreset_mode"] = specification.autoreset_mode;
  dict["world"] = to_dict(specification.world);
  dict["engine"] = specification.engine;
  dict["engine_version"] = specification.engine_version;
  dict["engine_path"] = to_str(specification.engine_path);
  dict["version"] = specification.version;
  return dict;
}

std::optional<std::uint64_t> to_seed(const py::object& value) {
  if (value.is_none()) return std::nullopt;
  try {
    // Accepts every integer type, also NumPy's.
    return py::reinterpret_steal<py::object>(PyNumber_Index(value.ptr())).cast<std::uint64_t>();
  } catch (const std::exception&) {
    PyErr_Clear();
    throw py::value_error("seed = " + shown(value) +
                          ": must be an integer from 0 to 2^64 - 1, or None");
  }
}

std::vector<std::optional<std::uint64_t>> to_seeds(const py::sequence& values) {
  std::vector<std::optional<std::uint64_t>> seeds;
  for (const py::handle value : values) {
    seeds.push_back(to_seed(py::reinterpret_borrow<py::object>(value)));
  }
  return seeds;
}

}  // namespace walker::python
