#include "server/markers/link_points.h"

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "description/poses.h"

namespace walker {
namespace {

/// The points of a solid among which is the lowest one in the world, in the link's frame.
/// @param down unit vector in the link's frame
std::vector<Eigen::Vector3d> candidates(const Solid& solid, const Eigen::Vector3d& down) {
  const auto [first, second, third] = solid.size;
  const Eigen::Isometry3d to_link = to_eigen(solid.pose);
  const Eigen::Vector3d own_down = to_link.linear().transpose() * down;
  std::vector<Eigen::Vector3d> points;
  switch (solid.kind) {
    case Solid::Kind::sphere:
      points.push_back(to_link * (first * own_down));
      break;
    case Solid::Kind::capsule:
      for (const double z : {second, -second}) {
        points.push_back(to_link * (first * own_down + Eigen::Vector3d(0, 0, z)));
      }
      break;
    case Solid::Kind::cylinder: {
      const Eigen::Vector2d across = own_down.head<2>().normalized();  // 0 stays 0
      for (const double z : {second, -second}) {
        points.push_back(to_link * Eigen::Vector3d(first * across.x(), first * across.y(), z));
      }
      break;
    }
    case Solid::Kind::box:
      for (const double x : {first, -first}) {
        for (const double y : {second, -second}) {
          for (const double z : {third, -third}) {
            points.push_back(to_link * Eigen::Vector3d(x, y, z));
          }
        }
      }
      break;
  }
  return points;
}

std::vector<Eigen::Vector3d> candidates(const Link& link, double y, const Eigen::Vector3d& down) {
  std::vector<Eigen::Vector3d> points;
  for (const Prism& prism : link.prisms) {
    for (const auto& [x, z] : prism.vertices) points.emplace_back(x, y, z);
  }
  for (const Solid& solid : link.solids) {
    const std::vector<Eigen::Vector3d> of_solid = candidates(solid, down);
    points.insert(points.end(), of_solid.begin(), of_solid.end());
  }
  return points;
}

}  // namespace

std::optional<Eigen::Vector3d> lowest_point(const Link& link, double y, const Pose& pose) {
  const Eigen::Isometry3d to_world = to_eigen(pose);
  const Eigen::Vector3d down = -to_world.linear().row(2);
  std::optional<Eigen::Vector3d> lowest;
  for (const Eigen::Vector3d& point : candidates(link, y, down)) {
    const Eigen::Vector3d in_world = to_world * point;
    if (!lowest || in_world.z() < lowest->z()) lowest = in_world;
  }
  return lowest;
}

double reach_of(const Specification& specification) {
  // Joints are in action order, which need not lead from the trunk outwards: as often as there are
  // joints, each takes what is known of its parent.
  std::map<std::string, double> to_joint;
  for (std::size_t i = 0; i < specification.joints.size(); ++i) {
    for (const Joint& joint : specification.joints) {
      to_joint[joint.child] = to_joint[joint.parent] + to_eigen(joint.origin).norm();
    }
  }
  double reach = 0;
  for (const Link& link : specification.links) {
    for (const Eigen::Vector3d& point : candidates(link, 0, {0, 0, -1})) {
      reach = std::max(reach, to_joint[link.name] + point.norm());
    }
  }
  return reach;
}

}  // namespace walker
