// Mass and moments of solids by summation over small cells.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "pose_algebra.h"
#include "walker_sim/specification.h"

namespace walker {

/// Sums of mass, first moments and inertia tensor over point masses.
struct Parts {
  double mass = 0;
  Vector3 first{};
  std::array<double, 6> second{};  // xx, yy, zz, xy, xz, yz

  void add(double part, const Vector3& p) {
    mass += part;
    for (std::size_t k = 0; k < 3; ++k) first[k] += part * p[k];
    const double square = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
    const std::array<double, 6> tensor{square - p[0] * p[0], square - p[1] * p[1],
                                       square - p[2] * p[2], -p[0] * p[1],
                                       -p[0] * p[2],         -p[1] * p[2]};
    for (std::size_t k = 0; k < 6; ++k) second[k] += part * tensor[k];
  }
};

inline bool contains(const Solid& solid, const Vector3& p) {
  const double radius = std::hypot(p[0], p[1]);
  const double height = std::abs(p[2]);
  switch (solid.kind) {
    case Solid::Kind::sphere:
      return std::hypot(radius, height) <= solid.size[0];
    case Solid::Kind::capsule:
      return std::hypot(radius, std::max(height - solid.size[1], 0.0)) <= solid.size[0];
    case Solid::Kind::cylinder:
      return radius <= solid.size[0] && height <= solid.size[1];
    case Solid::Kind::box:
      return std::abs(p[0]) <= solid.size[0] && std::abs(p[1]) <= solid.size[1] &&
             height <= solid.size[2];
  }
  return false;
}

/// Adds a solid's cells at their positions in the link's frame.
inline void add_solid(const Solid& solid, double density, Parts& parts) {
  constexpr int kCells = 60;
  const bool is_box = solid.kind == Solid::Kind::box;
  const bool has_caps = solid.kind == Solid::Kind::capsule;
  const bool is_sphere = solid.kind == Solid::Kind::sphere;
  Vector3 half{solid.size[0], solid.size[0], solid.size[0]};
  if (is_box) {
    half = solid.size;
  } else if (!is_sphere) {
    half[2] = solid.size[1] + (has_caps ? solid.size[0] : 0);
  }
  const double cell = 8 * half[0] * half[1] * half[2] / (kCells * kCells * kCells);
  const auto middle = [&](int i, double extent) { return extent * ((2 * i + 1.0) / kCells - 1); };
  for (int i = 0; i < kCells; ++i) {
    for (int j = 0; j < kCells; ++j) {
      for (int k = 0; k < kCells; ++k) {
        const Vector3 p{middle(i, half[0]), middle(j, half[1]), middle(k, half[2])};
        if (contains(solid, p)) parts.add(density * cell, transformed(solid.pose, p));
      }
    }
  }
}

}  // namespace walker
