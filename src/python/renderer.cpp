#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "python/arrays.h"
#include "python/bindings.h"
#include "python/conversions.h"
#include "walker_sim/registry.h"
#include "walker_sim/renderer.h"

namespace walker::python {
namespace py = pybind11;
namespace {

/// A thread-safe renderer: a mutex serialises the calls, and threads wait for it without the GIL.
/// No environment waits for it.
class RendererBinding {
 public:
  RendererBinding(const std::string& id, const py::dict& parameters,
                  const py::dict& camera_parameters)
      : renderer_(make_renderer(id, to_parameters(parameters), to_parameters(camera_parameters))) {}

  py::dict camera() const {
    const Camera& camera = renderer_->camera();
    py::dict dict;
    dict["width"] = camera.width;
    dict["height"] = camera.height;
    dict["focal_length"] = camera.focal_length;
    dict["near"] = camera.near;
    dict["far"] = camera.far;
    return dict;
  }

  /// @param rgb   height x width x 3, uint8; None: not drawn
  /// @param depth height x width, float32 [m]; None: not drawn
  void render(const StateCapture& captured, const py::object& rgb, const py::object& depth) {
    const Camera& camera = renderer_->camera();
    const std::size_t num_pixels = static_cast<std::size_t>(camera.width) * camera.height;
    std::optional<ColorOutput> colors;
    std::optional<DepthOutput> depths;
    if (!rgb.is_none()) colors.emplace(rgb, "rgb", 3 * num_pixels);
    if (!depth.is_none()) depths.emplace(depth, "depth", num_pixels);
    const GilFreeLock lock(mutex_);
    renderer_->render(captured, {colors.has_value(), depths.has_value()}, image_);
    if (colors) colors->write(image_.rgb.data());
    if (depths) depths->write(image_.depth.data());
  }

 private:
  std::unique_ptr<Renderer> renderer_;
  std::mutex mutex_;
  Image image_;
};

}  // namespace

void bind_renderer(py::module& module) {
  py::class_<StateCapture>(module, "StateCapture").def_readonly("step", &StateCapture::step);
  py::class_<RendererBinding>(module, "Renderer")
      .def(py::init<const std::string&, const py::dict&, const py::dict&>(), py::arg("id"),
           py::arg("parameters"), py::arg("camera_parameters"))
      .def_property_readonly("camera", &RendererBinding::camera)
      .def("render", &RendererBinding::render);
}

}  // namespace walker::python
