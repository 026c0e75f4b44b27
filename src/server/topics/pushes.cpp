#include "server/topics/pushes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "base/checks.h"
#include "base/parameter_text.h"
#include "base/printable_text.h"
#include "base/shortest_text.h"
#include "description/link_tree.h"

namespace walker {
namespace {

std::size_t index_of_link(const Frames& frames, const std::string& name) {
  const auto link = std::find(frames.links.begin(), frames.links.end(), name);
  if (link != frames.links.end()) return link - frames.links.begin();
  refuse_unknown("frame_id " + printable(name, kMaxQuotedBytes), name, frames.links);
}

Eigen::Vector3d finite(const std::string& name, const geometry_msgs::Vector3& vector,
                       const char* unit) {
  check_finite(name + ".x", vector.x, unit);
  check_finite(name + ".y", vector.y, unit);
  check_finite(name + ".z", vector.z, unit);
  return {vector.x, vector.y, vector.z};
}

/// @param out_of_plane component of `vector` along which the walker cannot move
void check_plane(const char* name, const Eigen::Vector3d& vector, double out_of_plane,
                 const char* unit) {
  constexpr double kRounding = 1e-6;  // of a rotation by a transform of single precision
  if (std::abs(out_of_plane) <= kRounding * vector.norm()) return;
  throw std::invalid_argument(std::string(name) + " has " + shortest_text(out_of_plane) + unit +
                              " out of the walker's plane of motion, odom's x,z; must be 0");
}

}  // namespace

LinkWrench to_link_wrench(const geometry_msgs::WrenchStamped& message, const Frames& frames,
                          const Sensors& sensors) {
  const std::size_t link = index_of_link(frames, message.header.frame_id);
  const Eigen::Quaterniond attitude = to_eigen(sensors.link_poses[link].orientation);
  const Eigen::Vector3d force = attitude * finite("force", message.wrench.force, " N");
  const Eigen::Vector3d torque = attitude * finite("torque", message.wrench.torque, " N m");
  check_plane("force", force, force.y(), " N");
  check_plane("torque", torque, std::hypot(torque.x(), torque.z()), " N m");
  return {static_cast<std::uint32_t>(link), force.x(), force.z(), torque.y()};
}

}  // namespace walker
