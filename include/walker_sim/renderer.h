// Pictures of a walker.
#pragma once

#include <cstdint>
#include <vector>

#include "walker_sim/environment.h"
#include "walker_sim/export.h"
#include "walker_sim/sensors.h"
#include "walker_sim/specification.h"

namespace walker {

/// All that a picture is drawn from. A copy: the walker may go on while it is drawn.
struct StateCapture {
  Sensors sensors;
  Scene scene;
  std::uint32_t step = 0;  ///< since the reset
};

/// Captures what an environment is like now. Changes nothing that a later step depends on.
/// @param step since the reset
WALKER_SIM_EXPORT void capture(Environment& environment, std::uint32_t step,
                               StateCapture& captured);

/// What a picture is made of.
struct Channels {
  bool color = true;
  bool depth = false;
};

/// A picture, its rows from top to bottom. What was not asked for is empty.
struct Image {
  std::uint32_t width = 0;        ///< [pixels]
  std::uint32_t height = 0;       ///< [pixels]
  std::vector<std::uint8_t> rgb;  ///< height x width x 3
  std::vector<float> depth;       ///< height x width: distance along the optical axis [m]
  Pose camera_pose;  ///< in the world; of the optical frame: x to the right, y down, z forward
};

/// How pictures come about.
struct Camera {
  std::uint32_t width = 0;   ///< [pixels]
  std::uint32_t height = 0;  ///< [pixels]
  double focal_length = 0;   ///< [pixels]; 0: the projection is parallel
  double near = 0;           ///< smallest depth that can be drawn [m]; 0: there is no depth
  double far = 0;            ///< largest one [m]
};

/// Draws environments of one kind. A picture depends on the capture alone.
///
/// Any thread may draw, one at a time. Nothing is loaded or allocated for it before the first
/// picture.
class WALKER_SIM_EXPORT Renderer {
 public:
  Renderer() = default;
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;
  virtual ~Renderer() = default;

  virtual const Camera& camera() const = 0;

  /// @param image keeps its memory from picture to picture
  /// @throws std::invalid_argument for a channel that there is none of; std::runtime_error where no
  ///         picture can be drawn on this machine, saying what to install
  virtual void render(const StateCapture& captured, const Channels& channels, Image& image) = 0;
};

}  // namespace walker
