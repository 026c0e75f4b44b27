#include "description/urdf.h"

#include <tinyxml2.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "base/shortest_text.h"
#include "description/link_tree.h"

namespace walker {
namespace {

// Velocity limit of a motor that has none [rad/s]: 20 rad in an engine step of 2 ms, which is never
// reached.
constexpr double kAnyVelocity = 10000;

// Notes in the file, for planar engines with inexact joints and for engines with exact joints.
constexpr const char* kPlanarNotes =
    "     Bodies move in the plane y = 0, which contains their masses. Only visuals and collision\n"
    "     shapes have a depth, and stand side by side. The actuators are velocity motors: limit's\n"
    "     velocity is their speed, effort their maximum torque. Numbers have single precision,\n"
    "     as in the engine.\n";
constexpr const char* kExactNotes =
    "     A link's frame is that of the engine's body. If the joint is elsewhere in that frame, "
    "it\n"
    "     turns a massless link, NAME_hinge, on which the body is fixed. Numbers read back as the\n"
    "     engine's doubles. The motors give their torque at any speed; URDF requires a velocity\n"
    "     limit, and 10000 means none.\n";

/// A rectangle in the x,z plane.
struct Rectangle {
  Eigen::Vector2d center;  ///< x, z [m]
  Eigen::Vector2d size;    ///< along its own x and z [m]
  double pitch;            ///< of its own axes, about +y, in [-pi/4, pi/4] [rad]
};

/// Returns the prism's section as a rectangle, if it is one within the engine's single precision.
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

/// Returns the inertia of a body whose engine knows only the moment about y. The other moments are
/// those of a prism of uniform density: iyy, the moment in the plane, is divided in proportion to
/// the section's second moments, and the depth adds m d^2/12 about x and z. Such a body can exist,
/// so every simulator accepts it. Motion in the plane does not depend on the added numbers.
/// @param link  its prisms must not overlap
/// @param depth of the prisms along y [m]
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

/// Returns the shortest text that reads back as the same float or double; 0 for -0.
std::string number_text(double value, bool is_single) {
  if (value == 0) value = 0;
  return is_single ? shortest_text(static_cast<float>(value)) : shortest_text(value);
}

template <typename Numbers>
std::string list_text(const Numbers& numbers, bool is_single) {
  std::string text;
  for (const double number : numbers) {
    text += (text.empty() ? "" : " ") + number_text(number, is_single);
  }
  return text;
}

struct Element {
  const char* name;
  std::vector<std::pair<const char*, std::string>> attributes;
  // GCC warns about an element without children unless there is an initializer.
  std::vector<Element> children = {};  // NOLINT(readability-redundant-member-init)
};

class Printer : public tinyxml2::XMLPrinter {
 public:
  void write(const Element& element) {
    OpenElement(element.name);
    for (const auto& [name, value] : element.attributes) PushAttribute(name, value.c_str());
    for (const Element& child : element.children) write(child);
    CloseElement();
  }

 protected:
  void PrintSpace(int depth) override {
    for (int i = 0; i < depth; ++i) Write("  ");
  }
};

/// Formats numbers itself, because urdfdom's exportURDF keeps only six digits.
class Writer {
 public:
  explicit Writer(const Specification& specification) : specification_(specification) {}

  UrdfFiles write(const std::string& name) {
    Element robot{"robot", {{"name", name}}};
    const std::map<std::string, Place> places = place_links(specification_);
    for (const Link& link : specification_.links) {
      robot.children.push_back(to_element(link, places.at(link.name)));
    }
    const std::vector<std::string> turned = turned_links(specification_);
    for (std::size_t i = 0; i < turned.size(); ++i) {
      add_joint(specification_.joints[i], turned[i], robot);
    }
    Printer xml;
    xml.PushDeclaration("xml version=\"1.0\"");
    xml.PushComment((" Generated by `rosrun walker_sim describe " + specification_.id +
                     "`; do not edit.\n" +
                     (specification_.joints_are_exact ? kExactNotes : kPlanarNotes))
                        .c_str());
    xml.write(robot);
    return {xml.CStr(), std::move(meshes_)};
  }

 private:
  Element to_element(const Link& link, const Place& place) {
    Element element{"link", {{"name", link.name}}};
    element.children = {{"inertial",
                         {},
                         {origin(link.center_of_mass),
                          {"mass", {{"value", text(link.mass)}}},
                          inertia(link, place)}}};
    add_prisms(link, place, element);
    for (const Solid& solid : link.solids) add_solid(link, solid, element);
    return element;
  }

  Element inertia(const Link& link, const Place& place) const {
    Inertia inertia = link.inertia;
    if (std::isnan(inertia.xx)) {
      if (link.prisms.empty()) throw std::invalid_argument("link " + link.name + ": has no shape");
      inertia = planar_inertia(link, place.depth);
    }
    return {"inertia",
            {{"ixx", text(inertia.xx)},
             {"ixy", text(inertia.xy)},
             {"ixz", text(inertia.xz)},
             {"iyy", text(inertia.yy)},
             {"iyz", text(inertia.yz)},
             {"izz", text(inertia.zz)}}};
  }

  void add_prisms(const Link& link, const Place& place, Element& to) {
    if (link.prisms.empty()) return;
    const Element in_place = origin({0, place.y, 0});
    to.children.push_back(visual(link, in_place, mesh(link.mesh + ".dae")));
    for (const Prism& prism : link.prisms) {
      if (const std::optional<Rectangle> box = to_rectangle(prism)) {
        to.children.push_back(
            collision(origin({box->center.x(), place.y, box->center.y()}, {0, box->pitch, 0}),
                      {"box", {{"size", list({box->size.x(), place.depth, box->size.y()})}}}));
      } else {
        to.children.push_back(collision(in_place, mesh(link.mesh + ".stl")));
      }
    }
  }

  Element mesh(const std::string& file) {
    meshes_.insert(file);
    return {"mesh", {{"filename", "package://walker_sim/assets/" + file}}};
  }

  void add_solid(const Link& link, const Solid& solid, Element& to) {
    const auto [first, second, third] = solid.size;
    const Element turned = origin(solid.pose.position, roll_pitch_yaw(solid.pose.orientation));
    const Element cylinder{"cylinder", {{"radius", text(first)}, {"length", text(2 * second)}}};
    const Element sphere{"sphere", {{"radius", text(first)}}};
    switch (solid.kind) {
      case Solid::Kind::sphere:
        add_shape(link, origin(solid.pose.position), sphere, to);
        break;
      case Solid::Kind::capsule:
        add_shape(link, turned, cylinder, to);
        for (const double z : {second, -second}) {
          const Eigen::Vector3d to_cap =
              to_eigen(solid.pose.orientation) * Eigen::Vector3d(0, 0, z);
          const Eigen::Vector3d cap = to_eigen(solid.pose.position) + to_cap;
          add_shape(link, origin({cap.x(), cap.y(), cap.z()}), sphere, to);
        }
        break;
      case Solid::Kind::cylinder:
        add_shape(link, turned, cylinder, to);
        break;
      case Solid::Kind::box:
        add_shape(link, turned, {"box", {{"size", list({2 * first, 2 * second, 2 * third})}}}, to);
        break;
    }
  }

  static void add_shape(const Link& link, const Element& pose, const Element& geometry,
                        Element& to) {
    to.children.push_back(visual(link, pose, geometry));
    to.children.push_back(collision(pose, geometry));
  }

  static Element visual(const Link& link, const Element& pose, const Element& geometry) {
    const Element color{"color", {{"rgba", list_text(link.color, true)}}};
    return {"visual",
            {},
            {pose, {"geometry", {}, {geometry}}, {"material", {{"name", link.name}}, {color}}}};
  }

  static Element collision(const Element& pose, const Element& geometry) {
    return {"collision", {}, {pose, {"geometry", {}, {geometry}}}};
  }

  /// @param turned name of the link that the joint turns
  void add_joint(const Joint& joint, const std::string& turned, Element& robot) const {
    const bool is_limited = std::isfinite(joint.lower) && std::isfinite(joint.upper);
    Element limit{"limit", {}};
    if (is_limited) {
      limit.attributes = {{"lower", text(joint.lower)}, {"upper", text(joint.upper)}};
    }
    limit.attributes.emplace_back("effort", text(joint.maximum_effort));
    limit.attributes.emplace_back("velocity", text(std::min(joint.maximum_velocity, kAnyVelocity)));
    robot.children.push_back(
        {"joint",
         {{"name", joint.name}, {"type", is_limited ? "revolute" : "continuous"}},
         {{"parent", {{"link", joint.parent}}},
          {"child", {{"link", turned}}},
          origin(joint.origin),
          {"axis", {{"xyz", list(joint.axis)}}},
          limit}});
    if (turned == joint.child) return;
    const Pose& frame = joint.child_frame;
    robot.children.push_back({"link", {{"name", turned}}});
    robot.children.push_back({"joint",
                              {{"name", turned + "_mount"}, {"type", "fixed"}},
                              {{"parent", {{"link", turned}}},
                               {"child", {{"link", joint.child}}},
                               origin(frame.position, roll_pitch_yaw(frame.orientation))}});
  }

  std::string text(double value) const {
    return number_text(value, !specification_.joints_are_exact);
  }
  std::string list(const Vector3& vector) const {
    return list_text(vector, !specification_.joints_are_exact);
  }

  Element origin(const Vector3& xyz) const { return {"origin", {{"xyz", list(xyz)}}}; }
  Element origin(const Vector3& xyz, const Vector3& rpy) const {
    return {"origin", {{"xyz", list(xyz)}, {"rpy", list(rpy)}}};
  }

  const Specification& specification_;
  std::set<std::string> meshes_;
};

}  // namespace

std::string robot_name(const std::string& id) {
  std::string name;
  for (const char c : id.substr(0, id.rfind("-v"))) {
    const auto letter = static_cast<unsigned char>(c);
    if (std::isupper(letter) != 0 && !name.empty()) name += '_';
    name += std::isalnum(letter) != 0 ? static_cast<char>(std::tolower(letter)) : '_';
  }
  return name;
}

UrdfFiles make_urdf(const Specification& specification, const std::string& name) {
  return Writer(specification).write(name);
}

}  // namespace walker
