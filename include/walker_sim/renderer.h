// Rendering of environments to images.
#pragma once

#include <cstdint>
#include <vector>

#include "walker_sim/environment.h"
#include "walker_sim/export.h"
#include "walker_sim/sensors.h"
#include "walker_sim/specification.h"

namespace walker {

/// The input of a renderer. It is a copy: the environment may be stepped while it is drawn.
struct StateCapture {
  Sensors sensors;
  Scene scene;
  std::uint32_t step = 0;  ///< since the reset
};

/// Captures the current state of an environment. Does not affect later steps.
/// @param step since the reset
WALKER_SIM_EXPORT void capture(Environment& environment, std::uint32_t step,
                               StateCapture& captured);

struct Channels {
  bool color = true;
  bool depth = false;
};

/// An image, rows from top to bottom. Channels that were not requested are empty.
struct Image {
  std::uint32_t width = 0;        ///< [pixels]
  std::uint32_t height = 0;       ///< [pixels]
  std::vector<std::uint8_t> rgb;  ///< height x width x 3
  std::vector<float> depth;       ///< height x width: distance along the optical axis [m]
  Pose camera_pose;  ///< optical frame in the world frame: x to the right, y down, z forward
};

/// Intrinsics of a camera.
struct Camera {
  std::uint32_t width = 0;   ///< [pixels]
  std::uint32_t height = 0;  ///< [pixels]
  double focal_length = 0;   ///< [pixels]; 0: orthographic projection
  double near = 0;           ///< smallest depth that can be drawn [m]; 0: no depth channel
  double far = 0;            ///< largest depth that can be drawn [m]
};

/// Draws environments of one kind. An image depends only on the capture.
///
/// Any thread may draw, one at a time. The first image loads the libraries and allocates memory.
class WALKER_SIM_EXPORT Renderer {
 public:
  Renderer() = default;
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;
  virtual ~Renderer() = default;

  virtual const Camera& camera() const = 0;

  /// @param image its memory is reused
  /// @throws std::invalid_argument if the renderer lacks a channel; std::runtime_error if the
  ///         machine cannot draw, with the package to install
  virtual void render(const StateCapture& captured, const Channels& channels, Image& image) = 0;
};

}  // namespace walker
