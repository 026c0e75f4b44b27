#include <algorithm>
#include <cmath>
#include <iomanip>
#include <map>
#include <string>
#include <utility>

#include <tf2_eigen/tf2_eigen.h>

#include "base/shortest_text.h"
#include "description/link_tree.h"
#include "server/markers/markers.h"

namespace walker {
namespace {

// Sizes of the range finder's markers [m].
constexpr double kRayWidth = 0.025;
constexpr double kHitDiameter = 0.14;
// Sizes of the walker's markers, relative to its reach (`reach_of`).
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

/// Largest distance of an outstretched limb's point from the trunk's origin [m]; scales markers.
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

/// Appends red rays to their hits, faint rays of maximum range without one, and a ball at each hit.
void append_rays(const RangeFinder& finder, const Sensors& sensors, const Header& header,
                 MarkerArray& array) {
  const Eigen::Vector3d origin = to_eigen(sensors.link_poses.front().position);
  // rviz ignores the alpha of a single line, so the faint rays need their own marker.
  Marker rays = make_marker(header, "rays", Marker::LINE_LIST, kRayWidth, kRayColor);
  Marker missed_rays =
      make_marker(header, "missed_rays", Marker::LINE_LIST, kRayWidth, kMissedRayColor);
  Marker hits = make_marker(header, "hits", Marker::SPHERE_LIST, kHitDiameter, kHitColor);
  const geometry_msgs::Point from = tf2::toMsg(origin);
  for (std::size_t i = 0; i < std::min(finder.num_rays, sensors.ranges.size()); ++i) {
    if (std::isnan(sensors.ranges[i])) continue;
    const bool is_hit = std::isfinite(sensors.ranges[i]);
    const double range = is_hit ? sensors.ranges[i] : sensors.maximum_range;
    const double angle = finder.angle_minimum + static_cast<double>(i) * finder.angle_increment;
    // The lidar frame's X is the world's x, its Y the world's z.
    const Eigen::Vector3d direction(std::cos(angle), 0, std::sin(angle));
    const geometry_msgs::Point to = tf2::toMsg(Eigen::Vector3d(origin + range * direction));
    Marker& lines = is_hit ? rays : missed_rays;
    lines.points.push_back(from);
    lines.points.push_back(to);
    if (is_hit) hits.points.push_back(to);
  }
  for (const Marker& marker : {rays, missed_rays, hits}) {
    array.markers.push_back(marker.points.empty() ? deletion(header, marker.ns.c_str()) : marker);
  }
}

/// A ball at the lowest point of each foot that touches the ground.
Marker contacts_marker(const Specification& specification, const Sensors& sensors, double diameter,
                       const Header& header) {
  Marker marker = make_marker(header, "contacts", Marker::SPHERE_LIST, diameter, kContactColor);
  const auto& names = specification.contact_links;
  if (names.empty()) return deletion(header, "contacts");
  const std::map<std::string, Place> places = place_links(specification);
  for (std::size_t i = 0; i < specification.links.size(); ++i) {
    const Link& link = specification.links[i];
    const auto sensor = std::find(names.begin(), names.end(), link.name) - names.begin();
    const auto index = static_cast<std::size_t>(sensor);
    if (index >= std::min(names.size(), sensors.contacts.size())) continue;
    if (sensors.contacts[index] == 0) continue;
    const std::optional<Eigen::Vector3d> lowest =
        lowest_point(link, places.at(link.name).y, sensors.link_poses[i]);
    if (lowest && lowest->allFinite()) marker.points.push_back(tf2::toMsg(*lowest));
  }
  return marker.points.empty() ? deletion(header, "contacts") : marker;
}

/// The last line, which changes, is not the longest one: rviz centres the text by its width. The
/// walker is near the left edge of the picture, so a long seed has a line of its own.
std::string text_of(const std::string& id, const EpisodeState& state) {
  constexpr std::size_t kMaxLine = 45;
  const std::string episode = id + "  episode " + std::to_string(state.episode);
  const std::string seed = state.seed ? "seed " + std::to_string(*state.seed) : "unseeded";
  ClassicStream text;
  text << episode << (episode.size() + 2 + seed.size() <= kMaxLine ? "  " : "\n") << seed;
  text << "\nstep " << state.step << "  return " << std::fixed << std::setprecision(1)
       << state.episode_return;
  if (!state.end_reason.empty()) text << "\n" << state.end_reason;
  return text.str();
}

Marker text_marker(const Eigen::Vector3d& trunk, double reach, std::string text,
                   const Header& header) {
  Marker marker =
      make_marker(header, "episode", Marker::TEXT_VIEW_FACING, kTextHeight * reach, kTextColor);
  const Eigen::Vector3d above(0, 0, kTextAltitude * reach);
  marker.pose.position = tf2::toMsg(Eigen::Vector3d(trunk + above));
  marker.text = std::move(text);
  return marker;
}

}  // namespace

Marker make_marker(const Header& header, const char* name, int type, double scale,
                   const Color& color) {
  Marker marker;
  marker.header = header;
  marker.ns = name;
  marker.type = type;
  marker.action = Marker::ADD;
  marker.pose.orientation.w = 1;
  marker.scale.x = marker.scale.y = marker.scale.z = scale;
  marker.color = to_color(color);
  return marker;
}

Marker deletion(const Header& header, const char* name) {
  Marker marker = make_marker(header, name, Marker::CUBE);
  marker.action = Marker::DELETE;
  return marker;
}

std_msgs::ColorRGBA to_color(const Color& color) {
  std_msgs::ColorRGBA message;
  message.r = static_cast<float>(color[0]);
  message.g = static_cast<float>(color[1]);
  message.b = static_cast<float>(color[2]);
  message.a = static_cast<float>(color[3]);
  return message;
}

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

MarkerArray state_markers(const Specification& specification, const Sensors& sensors,
                          const EpisodeState& state, const Header& header) {
  MarkerArray array;
  if (sensors.link_poses.empty()) return array;
  const Eigen::Vector3d trunk = to_eigen(sensors.link_poses.front().position);
  if (!trunk.allFinite()) return array;
  const double reach = reach_of(specification);
  if (specification.range_finder.num_rays != 0) {
    append_rays(specification.range_finder, sensors, header, array);
  }
  array.markers.push_back(
      contacts_marker(specification, sensors, kContactDiameter * reach, header));
  array.markers.push_back(text_marker(trunk, reach, text_of(specification.id, state), header));
  return array;
}

bool Path::add(const Vector3& trunk) {
  if (!to_eigen(trunk).allFinite()) return false;
  const geometry_msgs::Point point = tf2::toMsg(to_eigen(trunk));
  if (!points_.empty()) {
    const geometry_msgs::Point& last = points_.back();
    if (std::hypot(point.x - last.x, point.y - last.y, point.z - last.z) < kSpacing) return false;
  }
  if (points_.size() == kMaxPoints) points_.pop_front();
  points_.push_back(point);
  return true;
}

Marker Path::marker(const Header& header) const {
  constexpr std::size_t kLine = 2;
  if (points_.size() < kLine) return deletion(header, "path");
  Marker marker = make_marker(header, "path", Marker::LINE_STRIP, kPathWidth, kPathColor);
  marker.points.assign(points_.begin(), points_.end());
  return marker;
}

}  // namespace walker
