#include <unistd.h>

#include <atomic>
#include <cstddef>
#include <memory>
#include <shared_mutex>
#include <string>
#include <thread>

#include "base/posix.h"
#include "python/bindings.h"
#include "python/conversions.h"
#include "python/shown_state.h"
#include "walker_sim/registry.h"
#include "walker_sim/renderer.h"

namespace walker::python {
namespace py = pybind11;
namespace {

/// Lets the exit of Python wait for the pictures that other threads are drawing. Otherwise a daemon
/// thread would draw with an OpenGL whose own exit handlers have run.
class ExitGuard {
 public:
  /// Call without the GIL. Once the exit has begun, blocks every thread but the exiting one
  /// forever.
  std::shared_lock<std::shared_mutex> begin_picture() {
    std::shared_lock lock(mutex_, std::defer_lock);
    const std::thread::id exiting = exiting_;
    if (exiting == std::this_thread::get_id()) return lock;
    while (exiting != std::thread::id()) pause();
    lock.lock();
    return lock;
  }

  void exit() {
    if (num_forks() != num_forks_) return;  // a thread of the parent may hold the mutex
    const GilRelease released;
    exiting_ = std::this_thread::get_id();
    mutex_.lock();  // until the process ends
  }

 private:
  const unsigned num_forks_ = num_forks();
  std::shared_mutex mutex_;
  std::atomic<std::thread::id> exiting_{std::thread::id()};
};

ExitGuard& exit_guard() {
  static auto* const kGuard = new ExitGuard;  // never destroyed: daemon threads outlive the exit
  return *kGuard;
}

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
  void render(const ShownState& captured, const py::object& rgb, const py::object& depth) {
    const Camera& camera = renderer_->camera();
    const std::size_t num_pixels = static_cast<std::size_t>(camera.width) * camera.height;
    auto colors = to_output<ColorOutput>(rgb, "rgb", 3 * num_pixels);
    auto depths = to_output<DepthOutput>(depth, "depth", num_pixels);
    const GilRelease released;
    const auto picture = exit_guard().begin_picture();
    const CallMutex::Lock lock(mutex_);
    renderer_->render(captured, {colors.has_value(), depths.has_value()}, image_);
    if (colors) colors->write(image_.rgb.data());
    if (depths) depths->write(image_.depth.data());
  }

 private:
  std::unique_ptr<Renderer> renderer_;
  CallMutex mutex_;
  Image image_;
};

}  // namespace

void bind_renderer(py::module& module) {
  py::module::import("atexit").attr("register")(py::cpp_function([] { exit_guard().exit(); }));
  py::class_<RendererBinding>(module, "Renderer")
      .def(py::init<const std::string&, const py::dict&, const py::dict&>())
      .def_property_readonly("camera", &RendererBinding::camera)
      .def("render", &RendererBinding::render);
}

}  // namespace walker::python
