#include <pybind11/stl.h>

#include <string>

#include "python/bindings.h"
#include "python/conversions.h"
#include "walker_sim/world.h"

namespace walker::python {
namespace py = pybind11;
namespace {

py::list parameters_of(const std::string& id) {
  py::list list;
  for (const WorldParameter& parameter : world_parameters(id)) {
    py::dict entry;
    entry["name"] = parameter.name;
    entry["unit"] = parameter.unit;
    entry["description"] = parameter.description;
    entry["default"] = parameter.default_value;
    entry["minimum"] = parameter.minimum;
    entry["maximum"] = parameter.maximum;
    entry["is_whole"] = parameter.is_whole;
    list.append(entry);
  }
  return list;
}

}  // namespace

void bind_worlds(py::module& module) {
  module.def("world_presets", &world_presets);
  module.def("world_parameters", &parameters_of, py::arg("id"));
  module.def(
      "load_world", [](const std::string& text) { return to_dict(load_world(text)); },
      py::arg("preset_or_file"));
  module.def(
      "check_world",
      [](const std::string& id, const py::dict& world) { check_world(id, to_world(world)); },
      py::arg("id"), py::arg("world"));
  module.def(
      "world_text", [](const py::dict& world) { return to_str(to_string(to_world(world))); },
      py::arg("world"));
}

}  // namespace walker::python
