#include "description/planar_shapes.h"

#include <cmath>
#include <utility>
#include <vector>

namespace walker {
namespace {

/// Second moments of area about the centroid [m^4].
struct Section {
  double xx = 0;
  double zz = 0;
  double xz = 0;
};

/// Of all shapes together, which must not overlap.
Section section_of(const std::vector<Prism>& shapes) {
  double area = 0;
  std::array<double, 2> first{};
  Section section;
  for (const Prism& shape : shapes) {
    for (std::size_t i = 0; i < shape.vertices.size(); ++i) {
      const auto [x0, z0] = shape.vertices[i];
      const auto [x1, z1] = shape.vertices[(i + 1) % shape.vertices.size()];
      // Signed sums over the triangles between the origin and each edge.
      const double twice_area = x0 * z1 - x1 * z0;
      area += twice_area / 2;
      first[0] += (x0 + x1) * twice_area / 6;
      first[1] += (z0 + z1) * twice_area / 6;
      section.xx += (x0 * x0 + x0 * x1 + x1 * x1) * twice_area / 12;
      section.zz += (z0 * z0 + z0 * z1 + z1 * z1) * twice_area / 12;
      section.xz += (2 * x0 * z0 + x0 * z1 + x1 * z0 + 2 * x1 * z1) * twice_area / 24;
    }
  }
  section.xx -= first[0] * first[0] / area;
  section.zz -= first[1] * first[1] / area;
  section.xz -= first[0] * first[1] / area;
  return section;
}

std::array<double, 2> subtract(const std::array<double, 2>& a, const std::array<double, 2>& b) {
  return {a[0] - b[0], a[1] - b[1]};
}

double dot(const std::array<double, 2>& a, const std::array<double, 2>& b) {
  return a[0] * b[0] + a[1] * b[1];
}

}  // namespace

std::optional<Rectangle> to_rectangle(const Prism& prism) {
  constexpr std::size_t kCorners = 4;
  constexpr double kTolerance = 1e-5;  // of the size
  const auto& v = prism.vertices;
  if (v.size() != kCorners) return std::nullopt;
  std::array<double, 2> a = subtract(v[1], v[0]);
  std::array<double, 2> b = subtract(v[2], v[1]);
  const std::array<double, 2> opposite = subtract(v[2], v[3]);
  const double scale = dot(a, a) + dot(b, b);
  const std::array<double, 2> skew = subtract(a, opposite);
  if (std::abs(dot(a, b)) > kTolerance * scale) return std::nullopt;
  if (dot(skew, skew) > kTolerance * kTolerance * scale) return std::nullopt;
  // `a` becomes the edge nearest to +x.
  if (std::abs(a[0]) < std::abs(a[1])) std::swap(a, b);
  if (a[0] < 0) a = {-a[0], -a[1]};
  const std::array<double, 2> center{(v[0][0] + v[2][0]) / 2, (v[0][1] + v[2][1]) / 2};
  // The longer edge knows the direction better; a quarter turn back from the own z is the own x.
  if (b[1] < 0) b = {-b[0], -b[1]};
  const std::array<double, 2> x_axis =
      dot(b, b) > dot(a, a) ? std::array<double, 2>{b[1], -b[0]} : a;
  const double pitch = std::atan2(-x_axis[1], x_axis[0]);  // positive: turns x down
  return Rectangle{center, {std::sqrt(dot(a, a)), std::sqrt(dot(b, b))}, pitch};
}

Inertia planar_inertia(const Link& link, double depth) {
  const Section section = section_of(link.prisms);
  const double scale = link.inertia.yy / (section.xx + section.zz);
  const double of_depth = link.mass * depth * depth / 12;
  Inertia inertia;
  inertia.xx = scale * section.zz + of_depth;
  inertia.yy = link.inertia.yy;
  inertia.zz = scale * section.xx + of_depth;
  inertia.xz = -scale * section.xz;
  return inertia;
}

Vector3 normal_of(const Triangle& t) {
  Vector3 a{};
  Vector3 b{};
  for (std::size_t i = 0; i < a.size(); ++i) {
    a[i] = t[1][i] - t[0][i];
    b[i] = t[2][i] - t[0][i];
  }
  const Vector3 cross{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                      a[0] * b[1] - a[1] * b[0]};
  // Not hypot: its last bit differs between C libraries.
  const double length = std::sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]);
  if (length == 0) return {};
  return {cross[0] / length, cross[1] / length, cross[2] / length};
}

std::vector<Triangle> surface_of(const Prism& prism, double depth) {
  // The vertices run counter-clockwise seen from -y.
  const auto near = [&](std::size_t i) {
    return Vector3{prism.vertices[i][0], -depth / 2, prism.vertices[i][1]};
  };
  const auto far = [&](std::size_t i) {
    return Vector3{prism.vertices[i][0], depth / 2, prism.vertices[i][1]};
  };
  std::vector<Triangle> triangles;
  const std::size_t count = prism.vertices.size();
  for (std::size_t i = 1; i + 1 < count; ++i) {
    triangles.push_back({near(0), near(i), near(i + 1)});
    triangles.push_back({far(0), far(i + 1), far(i)});
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t next = (i + 1) % count;
    triangles.push_back({near(i), far(i), far(next)});
    triangles.push_back({near(i), far(next), near(next)});
  }
  return triangles;
}

}  // namespace walker
