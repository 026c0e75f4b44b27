#include "description/urdf.h"

#include <tinyxml2.h>

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
#include "description/planar_shapes.h"
#include "description/poses.h"

namespace walker {
namespace {

// Velocity limit of a motor that has none [rad/s]: 20 rad in an engine step of 2 ms, which is never
// reached.
constexpr double kAnyVelocity = 10000;

// Notes in the file, for planar engines with inexact joints and for engines with exact joints.
constexpr const char* kPlanarNotes =
    "     Bodies move in the plane y = 0, where their masses lie. Only what is seen and\n"
    "     collides has depth and stands beside each other. The actuators are velocity\n"
    "     motors: limit's velocity is the speed they run at, effort their torque's cap.\n"
    "     Numbers have the engine's precision, single.\n";
constexpr const char* kExactNotes =
    "     A link's frame is that of the engine's body. Where the joint sits elsewhere in it, the\n"
    "     joint turns a link without mass, NAME_hinge, on which the body is fixed. Numbers read\n"
    "     back as the engine's own, double. The motors give their torque at any speed; URDF\n"
    "     demands a velocity limit, and 10000 stands for none.\n";

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
    xml.PushComment((" Written by `rosrun walker_sim describe " + specification_.id +
                     "` out of the running world; do not edit.\n" +
                     (specification_.joints_are_exact ? kExactNotes : kPlanarNotes))
                        .c_str());
    xml.write(robot);
    return {xml.CStr(), std::move(meshes_)};
  }

 private:
  // ---------------------------------------------------------------- links

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

  // ---------------------------------------------------------------- joints

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

  // ---------------------------------------------------------------- text

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
