// A description of what viewers show of an episode: rviz's markers and a web page's picture are
// made from it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "walker_sim/sensors.h"
#include "walker_sim/specification.h"

namespace walker {

/// Shapes of one kind, which a viewer shows until it receives another drawing of this name. A
/// drawing without points means that nothing of this name is shown at present.
struct Drawing {
  enum class Kind {
    triangles,   ///< three points each, to be shown from both sides
    lines,       ///< two points each
    line_strip,  ///< a line through all points
    spheres,     ///< a centre each
    text         ///< one point: the middle of the text, which faces the viewer
  };

  explicit Drawing(std::string its_name, Kind its_kind = Kind::triangles, double its_size = 1,
                   const Color& its_color = {1, 1, 1, 1})
      : name(std::move(its_name)), kind(its_kind), size(its_size), color(its_color) {}

  std::string name;
  Kind kind;
  double size;  ///< width of lines, diameter of spheres, height of a capital letter [m]
  Color color;  ///< of what has no colours of its own
  std::vector<Vector3> points;  ///< in the world frame [m]
  std::vector<Color> colors;    ///< per point; empty: all have `color`
  std::string text;
};

/// Returns ground, obstacles with their outlines, clouds, flags and their poles. Every shade is
/// part of the colours, so viewers draw them unlit. They change only at a reset. The floor is a
/// separate drawing because it follows the walker.
std::vector<Drawing> scene_drawings(const Scene& scene);

/// Centre of the drawn floor for a walker at `x` [m]: `x` rounded to four tiles to change seldom.
double floor_center(const Floor& floor, double x);

/// Tiles of a floor around `center`, paler with distance. The pattern is fixed in the world.
/// @param center as `floor_center` returns it
Drawing floor_drawing(const Floor& floor, double center);

/// Returns the range finder's rays and hits, the feet's contacts and a text above the trunk.
/// Nothing if the trunk has no finite position; neither rays nor hits if there is no range finder.
/// @param text about the episode
std::vector<Drawing> state_drawings(const Specification& specification, const Sensors& sensors,
                                    const std::string& text);

/// Lowest point of the link's shapes in the world; none if the link has no shape.
/// @param y    centre of its prisms in y, in the link's frame [m]
/// @param pose of the link in the world
std::optional<Eigen::Vector3d> lowest_point(const Link& link, double y, const Pose& pose);

/// Path of the trunk through an episode: its latest points, each kSpacing or more from the last.
class Path {
 public:
  static constexpr double kSpacing = 0.1;         ///< minimum distance between points [m]
  static constexpr std::size_t kMaxPoints = 400;  ///< older ones are dropped

  /// Adds the point if it is the first, or far enough from the latest.
  /// @param trunk position in the world [m]; ignored if non-finite
  /// @return whether the path has changed
  bool add(const Vector3& trunk);

  void clear() { points_.clear(); }

  /// A line; without points if there are fewer than two.
  Drawing drawing() const;

 private:
  std::deque<Vector3> points_;
};

}  // namespace walker
