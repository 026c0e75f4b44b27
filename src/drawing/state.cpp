#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "description/link_tree.h"
#include "drawing/drawing.h"

namespace walker {
namespace {

// Sizes of the range finder's rays and hits [m].
constexpr double kRayWidth = 0.025;
constexpr double kHitDiameter = 0.14;
// Sizes of what belongs to the walker, relative to its reach (`reach_of`).
constexpr double kContactDiameter = 0.17;
constexpr double kPathWidth = 0.03;    // [m]
constexpr double kTextHeight = 0.11;   // of a capital letter
constexpr double kTextAltitude = 0.8;  // of the text's middle, above the trunk's origin

constexpr Color kRayColor{0.93, 0.1, 0.1, 0.85};
constexpr Color kMissedRayColor{0.93, 0.1, 0.1, 0.3};
constexpr Color kHitColor{0.93, 0.1, 0.1, 1};
constexpr Color kContactColor{1, 0.8, 0.1, 1};
constexpr Color kPathColor{0.1, 0.25, 0.75, 0.6};
constexpr Color kTextColor{0.16, 0.17, 0.25, 1};

/// Points of a solid that include its lowest one in the world, in the link's frame.
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

/// Largest distance of an outstretched limb's point from the trunk's origin [m]; scales drawings.
double reach_of(const Specification& specification) {
  // Joints are in action order, not always outwards from the trunk: one pass per joint reaches all.
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

/// Returns red rays to their hits, faint rays of maximum range without one, and a ball at each hit.
std::vector<Drawing> ray_drawings(const RangeFinder& finder, const Sensors& sensors) {
  const Vector3& origin = sensors.link_poses.front().position;
  Drawing rays("rays", Drawing::Kind::lines, kRayWidth, kRayColor);
  // rviz ignores the alpha of a single line, so the faint rays need their own drawing.
  Drawing missed_rays("missed_rays", Drawing::Kind::lines, kRayWidth, kMissedRayColor);
  Drawing hits("hits", Drawing::Kind::spheres, kHitDiameter, kHitColor);
  for (std::size_t i = 0; i < std::min(finder.num_rays, sensors.ranges.size()); ++i) {
    if (std::isnan(sensors.ranges[i])) continue;
    const bool is_hit = std::isfinite(sensors.ranges[i]);
    const double range = is_hit ? sensors.ranges[i] : sensors.maximum_range;
    const double angle = finder.angle_minimum + static_cast<double>(i) * finder.angle_increment;
    // The lidar frame's X is the world's x, its Y the world's z.
    const Vector3 end{origin[0] + range * std::cos(angle), origin[1],
                      origin[2] + range * std::sin(angle)};
    Drawing& lines = is_hit ? rays : missed_rays;
    lines.points.push_back(origin);
    lines.points.push_back(end);
    if (is_hit) hits.points.push_back(end);
  }
  return {rays, missed_rays, hits};
}

/// Returns a ball at the lowest point of each foot that touches the ground.
Drawing contacts_drawing(const Specification& specification, const Sensors& sensors,
                         double diameter) {
  Drawing drawing("contacts", Drawing::Kind::spheres, diameter, kContactColor);
  const auto& names = specification.contact_links;
  if (names.empty()) return drawing;
  const std::map<std::string, Place> places = place_links(specification);
  for (std::size_t i = 0; i < specification.links.size(); ++i) {
    const Link& link = specification.links[i];
    const auto sensor = std::find(names.begin(), names.end(), link.name) - names.begin();
    const auto index = static_cast<std::size_t>(sensor);
    if (index >= std::min(names.size(), sensors.contacts.size())) continue;
    if (sensors.contacts[index] == 0) continue;
    const std::optional<Eigen::Vector3d> lowest =
        lowest_point(link, places.at(link.name).y, sensors.link_poses[i]);
    if (lowest && lowest->allFinite()) {
      drawing.points.push_back({lowest->x(), lowest->y(), lowest->z()});
    }
  }
  return drawing;
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

std::vector<Drawing> state_drawings(const Specification& specification, const Sensors& sensors,
                                    const std::string& text) {
  std::vector<Drawing> drawings;
  if (sensors.link_poses.empty()) return drawings;
  const Vector3& trunk = sensors.link_poses.front().position;
  if (!to_eigen(trunk).allFinite()) return drawings;
  const double reach = reach_of(specification);
  if (specification.range_finder.num_rays != 0) {
    drawings = ray_drawings(specification.range_finder, sensors);
  }
  drawings.push_back(contacts_drawing(specification, sensors, kContactDiameter * reach));
  Drawing& episode =
      drawings.emplace_back("episode", Drawing::Kind::text, kTextHeight * reach, kTextColor);
  episode.points.push_back({trunk[0], trunk[1], trunk[2] + kTextAltitude * reach});
  episode.text = text;
  return drawings;
}

bool Path::add(const Vector3& trunk) {
  if (!to_eigen(trunk).allFinite()) return false;
  if (!points_.empty()) {
    const Vector3& last = points_.back();
    if (std::hypot(trunk[0] - last[0], trunk[1] - last[1], trunk[2] - last[2]) < kSpacing) {
      return false;
    }
  }
  if (points_.size() == kMaxPoints) points_.pop_front();
  points_.push_back(trunk);
  return true;
}

Drawing Path::drawing() const {
  constexpr std::size_t kLine = 2;
  Drawing drawing("path", Drawing::Kind::line_strip, kPathWidth, kPathColor);
  if (points_.size() >= kLine) drawing.points.assign(points_.begin(), points_.end());
  return drawing;
}

}  // namespace walker
