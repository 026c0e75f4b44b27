// The surface of a ground in the plane of motion, as lines.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "robots/level.h"

namespace walker::mujoco {

inline double dot(const Point& a, const Point& b) { return a.x * b.x + a.y * b.y; }
inline Point operator-(const Point& a, const Point& b) { return {a.x - b.x, a.y - b.y}; }
inline Point moved(const Point& from, const Point& direction, double distance) {
  return {from.x + direction.x * distance, from.y + direction.y * distance};
}

constexpr double kFarEnd = 1e4;  ///< length of the level ground at both ends [m]

/// A straight piece of a surface. On the way from its first point to its second, the earth is on
/// the right.
struct GroundPiece {
  Point from;    ///< [m]
  Point to;      ///< [m]
  Point along;   ///< unit vector
  Point before;  ///< `along` of the piece that ends where this one begins

  /// Unit vector out of the earth.
  Point normal() const { return {0.0 - along.y, along.x}; }

  double left() const { return from.x < to.x ? from.x : to.x; }
  double right() const { return from.x < to.x ? to.x : from.x; }

  /// Whether x is beside the piece, of which neighbours never share a point.
  bool spans(double x) const { return left() <= x && x < right(); }
};

/// A line from left to right, below which all is earth, and outlines of what hangs above it.
/// Points are (x, z) in the world [m].
class GroundLine {
 public:
  /// @param points   of the line, of which none is left of the one before it. The line continues
  ///                 level at both ends.
  /// @param outlines polygons, clockwise
  explicit GroundLine(std::vector<Point> points, std::vector<std::vector<Point>> outlines = {});

  /// In ascending order of their left ends. Points at which a line is straight and level are not
  /// in it.
  const std::vector<GroundPiece>& pieces() const { return pieces_; }

  /// The pieces that may have points between two x.
  struct Range {
    const GroundPiece* first;
    const GroundPiece* last;  ///< behind the range

    const GroundPiece* begin() const { return first; }
    const GroundPiece* end() const { return last; }

    /// Largest height of their ends [m].
    double top() const {
      double top = -std::numeric_limits<double>::infinity();
      for (const GroundPiece& piece : *this) top = std::max({top, piece.from.y, piece.to.y});
      return top;
    }

    /// Whether a point between these x is in the earth or in what hangs above it: an odd number of
    /// pieces is above such a point.
    bool has_inside(const Point& point) const {
      bool is_inside = false;
      for (const GroundPiece& piece : *this) {
        if (!piece.spans(point.x)) continue;
        const double height = dot(point - piece.from, piece.normal());
        is_inside ^= piece.along.x > 0 ? height < 0 : height > 0;
      }
      return is_inside;
    }
  };
  Range between(double left, double right) const;

  /// Returns the distance to the surface along a ray that comes from outside; +infinity: it is not
  /// within the range.
  /// @param direction unit vector
  double cast(const Point& origin, const Point& direction, double range) const;

 private:
  friend double top_around(const GroundLine& line, double x);
  void add(std::vector<Point> corners, bool is_closed);
  std::size_t cell_of(double x) const;

  std::vector<GroundPiece> pieces_;
  double first_ = 0;                    // left end of the first cell [m]
  std::vector<std::int32_t> in_cells_;  // for each, the first piece that ends in it or behind it
  std::vector<double> tops_;  // for each tenth one, an upper bound of the heights within 2 m
};

}  // namespace walker::mujoco
