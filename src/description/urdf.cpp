#include "description/urdf.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

#include "description/collada.h"
#include "description/planar_shapes.h"
#include "description/poses.h"
#include "description/stl.h"
#include "description/urdf_text.h"

namespace walker {
namespace {

// A motor without a velocity limit: a turn of 20 rad within 2 ms is beyond what it ever reaches.
constexpr double kAnyVelocity = 10000;

// What a reader of the file must know, by whether the engine's joints are exact.
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

/// The link with which the joint's branch of the trunk begins. Joints are in action order, which
/// need not lead from the trunk outwards.
std::string branch_of(const Specification& specification, const Joint& joint) {
  const Joint* inner = &joint;
  for (std::size_t i = 0; i < specification.joints.size(); ++i) {
    if (inner->parent == specification.links.front().name) return inner->child;
    const auto next =
        std::find_if(specification.joints.begin(), specification.joints.end(),
                     [&](const Joint& other) { return other.child == inner->parent; });
    if (next == specification.joints.end()) {
      throw std::invalid_argument("joint " + inner->name + ": unknown parent " + inner->parent);
    }
    inner = &*next;
  }
  throw std::invalid_argument("joint " + joint.name + ": hangs in a circle of joints");
}

class Writer {
 public:
  Writer(const Specification& specification, std::string name, std::string mesh_folder)
      : specification_(specification),
        name_(std::move(name)),
        mesh_folder_(std::move(mesh_folder)) {}

  UrdfFiles write(const UrdfDepths& depths) {
    xml_ << "<?xml version=\"1.0\"?>\n"
            "<!-- Written by `rosrun walker_sim describe "
         << specification_.id << "` out of the running world; do not edit.\n"
         << (specification_.joints_are_exact ? kExactNotes : kPlanarNotes) << "-->\n<robot name=\""
         << name_ << "\">\n";
    const std::map<std::string, Place> places = place_links(specification_, depths);
    for (const Link& link : specification_.links) write_link(link, places.at(link.name));
    const std::vector<std::string> turned = turned_links(specification_);
    for (std::size_t i = 0; i < turned.size(); ++i) {
      write_joint(specification_.joints[i], turned[i]);
    }
    xml_ << "</robot>\n";
    files_.urdf = xml_.str();
    return std::move(files_);
  }

 private:
  // ---------------------------------------------------------------- links

  void write_link(const Link& link, const Place& place) {
    xml_ << "  <link name=\"" << attribute_text(link.name) << "\">\n    <inertial>\n      "
         << origin(link.center_of_mass) << "\n      <mass value=\"" << text(link.mass)
         << "\"/>\n      " << inertia_element(link, place) << "\n    </inertial>\n";
    for (std::size_t i = 0; i < link.prisms.size(); ++i) write_prism(link, i, place);
    for (const Solid& solid : link.solids) write_solid(link, solid);
    xml_ << "  </link>\n";
  }

  std::string inertia_element(const Link& link, const Place& place) const {
    Inertia inertia = link.inertia;
    if (std::isnan(inertia.xx)) {
      if (link.prisms.empty()) throw std::invalid_argument("link " + link.name + ": has no shape");
      inertia = planar_inertia(link, place.depth);
    }
    return "<inertia ixx=\"" + text(inertia.xx) + "\" ixy=\"" + text(inertia.xy) + "\" ixz=\"" +
           text(inertia.xz) + "\" iyy=\"" + text(inertia.yy) + "\" iyz=\"" + text(inertia.yz) +
           "\" izz=\"" + text(inertia.zz) + "\"/>";
  }

  /// The meshes join the files.
  void write_prism(const Link& link, std::size_t index, const Place& place) {
    const Prism& prism = link.prisms[index];
    const std::string number = link.prisms.size() == 1 ? "" : "_" + std::to_string(index + 1);
    const std::string name = name_ + "_" + link.name + number;
    const std::string in_place = origin({0, place.y, 0});
    files_.meshes[name + ".dae"] = make_collada(prism, place.depth, link.color);
    write_visual(link, in_place, mesh(name + ".dae"));
    if (const std::optional<Rectangle> box = to_rectangle(prism)) {
      write_collision(
          origin({box->center[0], place.y, box->center[1]}, {0, box->pitch, 0}),
          "<box size=\"" + list(Vector3{box->size[0], place.depth, box->size[1]}) + "\"/>");
      return;
    }
    files_.meshes[name + ".stl"] = make_stl(prism, place.depth);
    write_collision(in_place, mesh(name + ".stl"));
  }

  std::string mesh(const std::string& file) const {
    return "<mesh filename=\"" + mesh_folder_ + "/" + file + "\"/>";
  }

  void write_solid(const Link& link, const Solid& solid) {
    const Vector3& center = solid.pose.position;
    const std::string turned = origin(center, roll_pitch_yaw(solid.pose.orientation));
    const auto [first, second, third] = solid.size;
    const std::string cylinder =
        "<cylinder radius=\"" + text(first) + "\" length=\"" + text(2 * second) + "\"/>";
    const std::string sphere = "<sphere radius=\"" + text(first) + "\"/>";
    switch (solid.kind) {
      case Solid::Kind::sphere:
        write_shape(link, origin(center), sphere);
        break;
      case Solid::Kind::capsule:
        write_shape(link, turned, cylinder);
        for (const double z : {second, -second}) {
          const Vector3 to_cap = rotate(solid.pose.orientation, {0, 0, z});
          write_shape(link, origin(add(center, to_cap)), sphere);
        }
        break;
      case Solid::Kind::cylinder:
        write_shape(link, turned, cylinder);
        break;
      case Solid::Kind::box:
        write_shape(link, turned,
                    "<box size=\"" + list(Vector3{2 * first, 2 * second, 2 * third}) + "\"/>");
        break;
    }
  }

  /// What is seen is what collides.
  void write_shape(const Link& link, const std::string& origin_element,
                   const std::string& geometry) {
    write_visual(link, origin_element, geometry);
    write_collision(origin_element, geometry);
  }

  void write_visual(const Link& link, const std::string& origin_element,
                    const std::string& geometry) {
    xml_ << "    <visual>\n"
         << placed(origin_element, geometry) << "      <material name=\""
         << attribute_text(link.name) << "\">\n        <color rgba=\""
         << list_text(link.color, Precision::in_single)
         << "\"/>\n      </material>\n    </visual>\n";
  }

  void write_collision(const std::string& origin_element, const std::string& geometry) {
    xml_ << "    <collision>\n" << placed(origin_element, geometry) << "    </collision>\n";
  }

  static std::string placed(const std::string& origin_element, const std::string& geometry) {
    return "      " + origin_element + "\n      <geometry>\n        " + geometry +
           "\n      </geometry>\n";
  }

  // ---------------------------------------------------------------- joints

  /// @param turned the link that it turns
  void write_joint(const Joint& joint, const std::string& turned) {
    const bool is_limited = std::isfinite(joint.lower) && std::isfinite(joint.upper);
    begin_joint(joint.name, is_limited ? "revolute" : "continuous", joint.parent, turned);
    xml_ << "    " << origin(joint.origin) << "\n    <axis xyz=\"" << list(joint.axis)
         << "\"/>\n    <limit ";
    if (is_limited) {
      xml_ << "lower=\"" << text(joint.lower) << "\" upper=\"" << text(joint.upper) << "\" ";
    }
    xml_ << "effort=\"" << text(joint.maximum_effort) << "\" velocity=\""
         << text(std::min(joint.maximum_velocity, kAnyVelocity)) << "\"/>\n  </joint>\n";
    if (turned == joint.child) return;
    xml_ << "  <link name=\"" << attribute_text(turned) << "\"/>\n";
    begin_joint(turned + "_mount", "fixed", turned, joint.child);
    xml_ << "    "
         << origin(joint.child_frame.position, roll_pitch_yaw(joint.child_frame.orientation))
         << "\n  </joint>\n";
  }

  void begin_joint(const std::string& name, const char* type, const std::string& parent,
                   const std::string& child) {
    xml_ << "  <joint name=\"" << attribute_text(name) << "\" type=\"" << type
         << "\">\n    <parent link=\"" << attribute_text(parent) << "\"/>\n    <child link=\""
         << attribute_text(child) << "\"/>\n";
  }

  // ---------------------------------------------------------------- text

  Precision precision() const {
    return specification_.joints_are_exact ? Precision::in_double : Precision::in_single;
  }

  std::string text(double value) const { return number_text(value, precision()); }

  template <typename Numbers>
  std::string list(const Numbers& numbers) const {
    return list_text(numbers, precision());
  }

  std::string origin(const Vector3& xyz) const { return "<origin xyz=\"" + list(xyz) + "\"/>"; }

  std::string origin(const Vector3& xyz, const Vector3& rpy) const {
    return "<origin xyz=\"" + list(xyz) + "\" rpy=\"" + list(rpy) + "\"/>";
  }

  const Specification& specification_;
  std::string name_;
  std::string mesh_folder_;
  std::ostringstream xml_;
  UrdfFiles files_;
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

std::map<std::string, Place> place_links(const Specification& specification,
                                         const UrdfDepths& depths) {
  const std::string& trunk = specification.links.front().name;
  std::map<std::string, Place> places{{trunk, {0, depths.trunk}}};
  std::vector<std::string> branches;  // by the link with which each begins
  for (const Joint& joint : specification.joints) {
    if (joint.parent == trunk) branches.push_back(joint.child);
  }
  const double spacing = depths.trunk + depths.limb + 2 * depths.gap;
  const double first = static_cast<double>(branches.size() + 1) / 2 * spacing;
  for (const Joint& joint : specification.joints) {
    const auto branch =
        std::find(branches.begin(), branches.end(), branch_of(specification, joint));
    const auto number = static_cast<double>(branch - branches.begin() + 1);
    places[joint.child] = {first - number * spacing, depths.limb};
  }
  return places;
}

std::vector<std::string> turned_links(const Specification& specification) {
  std::vector<std::string> names;
  const auto is_taken = [&](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end() ||
           std::any_of(specification.links.begin(), specification.links.end(),
                       [&](const Link& link) { return link.name == name; });
  };
  for (const Joint& joint : specification.joints) {
    std::string name = joint.child;
    if (!is_identity(joint.child_frame)) {
      do name += "_hinge";
      while (is_taken(name));
    }
    names.push_back(name);
  }
  return names;
}

UrdfFiles make_urdf(const Specification& specification, const std::string& name,
                    const std::string& mesh_folder, const UrdfDepths& depths) {
  return Writer(specification, name, mesh_folder).write(depths);
}

}  // namespace walker
