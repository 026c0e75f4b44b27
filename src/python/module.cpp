// The module walker_sim._core: this package's environments, pool and client for Python.
#include <pybind11/pybind11.h>

#include <pybind11/stl.h>

#include <exception>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "base/interruption.h"
#include "base/parameter_text.h"
#include "python/bindings.h"
#include "python/conversions.h"
#include "walker_sim/client.h"
#include "walker_sim/environment.h"
#include "walker_sim/parameters.h"
#include "walker_sim/registry.h"
#include "walker_sim/world.h"

namespace walker::python {
namespace py = pybind11;
namespace {

/// Sets the exception of this name in walker_sim.errors as the Python error.
void raise(const char* name, const std::exception& error) {
  PyErr_SetObject(py::module::import("walker_sim.errors").attr(name).ptr(),
                  to_str(error.what()).ptr());
}

// pybind11 requires a parameter by value. NOLINTNEXTLINE(performance-unnecessary-value-param)
void translate(std::exception_ptr thrown) {
  try {
    if (thrown) std::rethrow_exception(thrown);
  } catch (const InvalidAction& error) {
    raise("InvalidAction", error);
  } catch (const ResetNeeded& error) {
    raise("ResetNeeded", error);
  } catch (const ConnectionError& error) {
    raise("ConnectionError", error);
  } catch (const RequestRefused& error) {
    raise("RequestRefused", error);
    // NOLINTNEXTLINE(bugprone-empty-catch): the signal handler's exception is set
  } catch (const Interrupted&) {
  } catch (const std::invalid_argument& error) {  // a file name in it may not be UTF-8
    PyErr_SetObject(PyExc_ValueError, to_str(error.what()).ptr());
  }
}

/// Polls without the GIL, so that other Python threads run. Python handles signals in its main
/// thread only.
/// @throws Interrupted if a signal handler has raised, as that of Ctrl-C does
int poll_as_python(pollfd* files, nfds_t num_files, int timeout) {
  int result = 0;
  if (PyGILState_Check() == 0) {
    result = ::poll(files, num_files, timeout);
    if (released_state == nullptr) return result;  // a thread of ours cannot run handlers
    const GilHold hold;
    if (PyErr_CheckSignals() != 0) throw Interrupted();
    return result;
  }
  if (timeout == 0) {
    result = ::poll(files, num_files, timeout);
  } else {
    const GilRelease release;
    result = ::poll(files, num_files, timeout);
  }
  if (PyErr_CheckSignals() != 0) throw Interrupted();
  return result;
}

std::vector<std::string> ids() {
  std::vector<std::string> names;
  for (const Registration& registration : registrations()) names.push_back(registration.id);
  return names;
}

/// @param descriptions of type ParameterDescription or WorldParameter
template <typename Description>
py::list to_list(const std::vector<Description>& descriptions) {
  py::list list;
  for (const Description& description : descriptions) {
    py::dict entry;
    entry["name"] = description.name;
    entry["unit"] = description.unit;
    entry["description"] = description.description;
    entry["default"] = description.default_value;
    if constexpr (std::is_same_v<Description, WorldParameter>) {
      entry["minimum"] = description.minimum;
      entry["maximum"] = description.maximum;
      entry["is_whole"] = description.is_whole;
      entry["can_change"] = description.can_change;
    }
    list.append(entry);
  }
  return list;
}

py::dict registration_of(const std::string& id) {
  const Registration& registration = find_registration(id);
  py::dict dict;
  dict["failure_reward"] = registration.failure_reward;
  dict["render_modes"] = registration.render_modes;
  dict["takes_default_camera_config"] = registration.takes_default_camera_config;
  return dict;
}

}  // namespace

// cppcheck-suppress syntaxError  // which knows no macro of pybind11
PYBIND11_MODULE(_core, module) {
  py::register_exception_translator(&translate);
  set_poll(&poll_as_python, true);
  module.attr("__version__") = version();
  module.def("shown", &shown);
  module.def("ids", &ids);
  module.def("parameters_of",
             [](const std::string& id) { return to_list(parameter_descriptions(id)); });
  module.def("camera_parameters_of",
             [](const std::string& id) { return to_list(camera_parameter_descriptions(id)); });
  module.def(
      "parse_assignments", [](const std::string& id, const std::vector<std::string>& assignments) {
        std::vector<ParameterDescription> known = parameter_descriptions(id);
        const std::vector<ParameterDescription> of_camera = camera_parameter_descriptions(id);
        known.insert(known.end(), of_camera.begin(), of_camera.end());
        return parse_assignments(known, assignments);
      });
  module.def("registration_of", &registration_of);
  module.def("world_presets", &world_presets);
  module.def("world_parameters",
             [](const std::string& id) { return to_list(world_parameters(id)); });
  module.def("load_world", [](const std::string& text) { return to_dict(load_world(text)); });
  module.def("parse_world", [](const std::string& text, const std::string& source) {
    return to_dict(parse_world(text, source));
  });
  module.def("check_world", [](const std::string& id, const py::dict& world) {
    check_world(id, to_world(world));
  });
  module.def("world_text",
             [](const py::dict& world) { return to_str(to_string(to_world(world))); });
  bind_drawing(module);
  bind_renderer(module);
  bind_pool(module);
  bind_client(module);
  bind_policy(module);
}

}  // namespace walker::python
