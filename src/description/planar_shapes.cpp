#include "description/planar_shapes.h"

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

namespace walker {
namespace {

/// Second moments of area of all shapes about their common centroid [m^4]. They must not overlap.
Eigen::Matrix2d second_moments(const std::vector<Prism>& shapes) {
  double area = 0;
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  for (const Prism& shape : shapes) {
    for (std::size_t i = 0; i < shape.vertices.size(); ++i) {
      const Eigen::Vector2d a(shape.vertices[i].data());
      const Eigen::Vector2d b(shape.vertices[(i + 1) % shape.vertices.size()].data());
      const Eigen::Vector2d sum = a + b;
      // Signed sums over the triangles between the origin and each edge.
      const double twice_area = a.x() * b.y() - b.x() * a.y();
      area += twice_area / 2;
      first += twice_area / 6 * sum;
      second += twice_area / 24 * (sum * sum.transpose() + a * a.transpose() + b * b.transpose());
    }
  }
  return second - first * first.transpose() / area;
}

}  // namespace

std::optional<Rectangle> to_rectangle(const Prism& prism) {
  constexpr std::size_t kCorners = 4;
  constexpr double kTolerance = 1e-5;  // relative to the size
  if (prism.vertices.size() != kCorners) return std::nullopt;
  const Eigen::Map<const Eigen::Matrix<double, 2, kCorners>> corners(prism.vertices[0].data());
  Eigen::Vector2d a = corners.col(1) - corners.col(0);
  Eigen::Vector2d b = corners.col(2) - corners.col(1);
  const Eigen::Vector2d opposite = corners.col(2) - corners.col(3);
  const double scale = a.squaredNorm() + b.squaredNorm();
  if (std::abs(a.dot(b)) > kTolerance * scale) return std::nullopt;
  if ((a - opposite).squaredNorm() > kTolerance * kTolerance * scale) return std::nullopt;
  // `a` becomes the edge nearest to +x.
  if (std::abs(a.x()) < std::abs(a.y())) a.swap(b);
  if (a.x() < 0) a = -a;
  if (b.y() < 0) b = -b;
  // The longer edge gives the more accurate direction. If it is the z axis, a quarter turn back
  // gives the x axis.
  const bool is_high = b.squaredNorm() > a.squaredNorm();
  const Eigen::Vector2d x_axis = is_high ? Eigen::Vector2d(b.y(), -b.x()) : a;
  const double pitch = std::atan2(-x_axis.y(), x_axis.x());  // positive pitch turns x down
  return Rectangle{(corners.col(0) + corners.col(2)) / 2, {a.norm(), b.norm()}, pitch};
}

Inertia planar_inertia(const Link& link, double depth) {
  const Eigen::Matrix2d section = second_moments(link.prisms);
  const double scale = link.inertia.yy / section.trace();
  const double of_depth = link.mass * depth * depth / 12;
  Inertia inertia;
  inertia.xx = scale * section(1, 1) + of_depth;
  inertia.yy = link.inertia.yy;
  inertia.zz = scale * section(0, 0) + of_depth;
  inertia.xz = -scale * section(0, 1);
  return inertia;
}

}  // namespace walker
