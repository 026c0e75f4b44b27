#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "drawing/drawing.h"
#include "drawing/links.h"
#include "python/bindings.h"
#include "python/conversions.h"
#include "python/shown_state.h"
#include "walker_sim/registry.h"

namespace walker::python {
namespace py = pybind11;
namespace {

/// Returns a NumPy array with the values of one row in each of its rows.
/// @tparam kType NumPy's character of the element type
template <typename Value, char kType, typename From, std::size_t kColumns>
py::object to_array(const std::vector<std::array<From, kColumns>>& rows) {
  py::object array = py::module::import("numpy").attr("empty")(
      py::make_tuple(rows.size(), kColumns), std::string(1, kType));
  ExactOutput<Value, kType> output(array, "array", rows.size() * kColumns);
  Value* to = output.data();
  for (const auto& row : rows) {
    to = std::transform(row.begin(), row.end(), to,
                        [](From value) { return static_cast<Value>(value); });
  }
  return array;
}

py::tuple to_tuple(const Color& color) {
  return py::make_tuple(color[0], color[1], color[2], color[3]);
}

const char* kind_text(Drawing::Kind kind) {
  switch (kind) {
    case Drawing::Kind::triangles:
      return "triangles";
    case Drawing::Kind::lines:
      return "lines";
    case Drawing::Kind::line_strip:
      return "line_strip";
    case Drawing::Kind::spheres:
      return "spheres";
    case Drawing::Kind::text:
      return "text";
  }
  throw std::logic_error("unknown kind of drawing");
}

/// `colors` is None if all points have `color`.
py::dict to_dict(const Drawing& drawing) {
  py::dict dict;
  dict["name"] = drawing.name;
  dict["kind"] = kind_text(drawing.kind);
  dict["size"] = drawing.size;
  dict["color"] = to_tuple(drawing.color);
  dict["points"] = to_array<float, 'f'>(drawing.points);
  dict["colors"] = drawing.colors.empty() ? py::none() : to_array<float, 'f'>(drawing.colors);
  dict["text"] = drawing.text;
  return dict;
}

py::list to_list(const std::vector<Drawing>& drawings) {
  py::list list;
  for (const Drawing& drawing : drawings) list.append(to_dict(drawing));
  return list;
}

/// Returns one row per link: x, y, z [m], then the orientation as qw, qx, qy, qz.
py::object link_poses(const ShownState& shown) {
  std::vector<std::array<double, 7>> rows;
  rows.reserve(shown.sensors.link_poses.size());
  for (const auto& [p, q] : shown.sensors.link_poses) {
    rows.push_back({p[0], p[1], p[2], q[3], q[0], q[1], q[2]});
  }
  return to_array<double, 'd'>(rows);
}

/// Returns the centre of the floor that is drawn around the trunk [m]. None if there is no floor or
/// the trunk has no finite position.
std::optional<double> center_of_floor(const ShownState& shown) {
  if (!shown.scene.floor) return std::nullopt;
  const double x = shown.sensors.link_poses.front().position[0];
  if (!std::isfinite(x)) return std::nullopt;
  return floor_center(*shown.scene.floor, x);
}

/// @throws ValueError if the environment has no floor
py::dict drawing_of_floor(const ShownState& shown, double center) {
  if (!shown.scene.floor) throw py::value_error("floor_drawing: the environment has no floor");
  return to_dict(floor_drawing(*shown.scene.floor, center));
}

py::list links_of(const std::string& id, const py::dict& parameters) {
  py::list links;
  for (const auto& [name, meshes] :
       link_shapes(make(id, to_parameters(parameters))->specification())) {
    py::list list;
    for (const Mesh& mesh : meshes) {
      py::dict dict;
      dict["vertices"] = to_array<float, 'f'>(mesh.vertices);
      dict["faces"] = to_array<std::uint32_t, 'I'>(mesh.faces);
      dict["color"] = to_tuple(mesh.color);
      list.append(dict);
    }
    py::dict link;
    link["name"] = name;
    link["meshes"] = list;
    links.append(link);
  }
  return links;
}

}  // namespace

void bind_drawing(py::module& module) {
  py::class_<Path>(module, "Path")
      .def(py::init<>())
      .def("add", &Path::add)
      .def("clear", &Path::clear)
      .def("drawing", [](const Path& path) { return to_dict(path.drawing()); });
  module.def("link_shapes", &links_of);
  py::class_<ShownState>(module, "StateCapture")
      .def_readonly("step", &StateCapture::step)
      .def_property_readonly("link_poses", &link_poses)
      .def_property_readonly("joint_positions",
                             [](const ShownState& shown) { return shown.sensors.joint_position; })
      .def_property_readonly("floor_center", &center_of_floor)
      .def("floor_drawing", &drawing_of_floor)
      .def("scene_drawings",
           [](const ShownState& shown) { return to_list(scene_drawings(shown.scene)); })
      .def(
          "state_drawings",
          [](const ShownState& shown, const std::string& text) {
            return to_list(state_drawings(*shown.specification, shown.sensors, text));
          },
          py::arg("text") = "");
}

}  // namespace walker::python
