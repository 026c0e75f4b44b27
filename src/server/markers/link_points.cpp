#include "server/markers/link_points.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "description/poses.h"

namespace walker {
namespace {

double length_of(const Vector3& v) { return std::hypot(v[0], v[1], v[2]); }

/// The points of a solid among which is the lowest one in the world, in the link's frame.
std::vector<Vector3> candidates(const Solid& solid, const Vector3& down) {
  const auto [first, second, third] = solid.size;
  const Vector3 own_down = rotate(conjugate(solid.pose.orientation), down);
  const auto to_link = [&](const Vector3& own) {
    return add(solid.pose.position, rotate(solid.pose.orientation, own));
  };
  std::vector<Vector3> points;
  switch (solid.kind) {
    case Solid::Kind::sphere:
      points.push_back(to_link({first * own_down[0], first * own_down[1], first * own_down[2]}));
      break;
    case Solid::Kind::capsule:
      for (const double z : {second, -second}) {
        points.push_back(
            to_link({first * own_down[0], first * own_down[1], first * own_down[2] + z}));
      }
      break;
    case Solid::Kind::cylinder: {
      const double across = std::hypot(own_down[0], own_down[1]);
      const double radius = across > 0 ? first / across : 0;
      for (const double z : {second, -second}) {
        points.push_back(to_link({radius * own_down[0], radius * own_down[1], z}));
      }
      break;
    }
    case Solid::Kind::box:
      for (const double x : {first, -first}) {
        for (const double y : {second, -second}) {
          for (const double z : {third, -third}) points.push_back(to_link({x, y, z}));
        }
      }
      break;
  }
  return points;
}

std::vector<Vector3> candidates(const Link& link, double y, const Vector3& down) {
  std::vector<Vector3> points;
  for (const Prism& prism : link.prisms) {
    for (const auto& [x, z] : prism.vertices) points.push_back({x, y, z});
  }
  for (const Solid& solid : link.solids) {
    const std::vector<Vector3> of_solid = candidates(solid, down);
    points.insert(points.end(), of_solid.begin(), of_solid.end());
  }
  return points;
}

}  // namespace

std::optional<Vector3> lowest_point(const Link& link, double y, const Pose& pose) {
  const Vector3 down = rotate(conjugate(pose.orientation), {0, 0, -1});
  std::optional<Vector3> lowest;
  for (const Vector3& point : candidates(link, y, down)) {
    const Vector3 in_world = add(pose.position, rotate(pose.orientation, point));
    if (!lowest || in_world[2] < (*lowest)[2]) lowest = in_world;
  }
  return lowest;
}

double reach_of(const Specification& specification) {
  // Joints are in action order, which need not lead from the trunk outwards: as often as there are
  // joints, each takes what is known of its parent.
  std::map<std::string, double> to_joint;
  for (std::size_t i = 0; i < specification.joints.size(); ++i) {
    for (const Joint& joint : specification.joints) {
      to_joint[joint.child] = to_joint[joint.parent] + length_of(joint.origin);
    }
  }
  double reach = 0;
  for (const Link& link : specification.links) {
    for (const Vector3& point : candidates(link, 0, {0, 0, -1})) {
      reach = std::max(reach, to_joint[link.name] + length_of(point));
    }
  }
  return reach;
}

}  // namespace walker
