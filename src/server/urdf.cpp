#include "server/urdf.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "server/stl.h"

namespace walker {
namespace {

/// Shortest text that reads back as the same single, which is the engine's precision.
std::string text(double value) {
  constexpr int kPlain = 3;  // fewer digits would write 80 as 8e+01
  constexpr int kExact = 9;
  const auto single = static_cast<float>(value == 0 ? 0.0 : value);  // no -0
  std::string result;
  for (int digits = kPlain; digits <= kExact; ++digits) {
    std::ostringstream stream;
    stream.precision(digits);
    stream << single;
    result = stream.str();
    if (std::strtof(result.c_str(), nullptr) == single) break;
  }
  return result;
}

template <typename Numbers>
std::string list(const Numbers& numbers) {
  std::string result;
  for (const double number : numbers) result += (result.empty() ? "" : " ") + text(number);
  return result;
}

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

/// The engine knows the inertia about y alone. The rest is that of a prism of this depth whose
/// density does not vary: iyy, the moment in the plane, is shared out as the section's second
/// moments are, and the depth adds m d^2/12 about x and z. Such a body exists, so every simulator
/// accepts it; motion in the plane does not depend on these numbers.
std::string inertia_element(const Link& link, double depth) {
  const Section section = section_of(link.prisms);
  const double scale = link.inertia.yy / (section.xx + section.zz);
  const double of_depth = link.mass * depth * depth / 12;
  return "<inertia ixx=\"" + text(scale * section.zz + of_depth) + "\" ixy=\"0\" ixz=\"" +
         text(-scale * section.xz) + "\" iyy=\"" + text(link.inertia.yy) + "\" iyz=\"0\" izz=\"" +
         text(scale * section.xx + of_depth) + "\"/>";
}

/// A rectangle in the x,z plane.
struct Rectangle {
  std::array<double, 2> center;  ///< x, z [m]
  std::array<double, 2> size;    ///< along its own x and z [m]
  double pitch;                  ///< of its own axes, about +y, at most pi/4 either way [rad]
};

std::array<double, 2> subtract(const std::array<double, 2>& a, const std::array<double, 2>& b) {
  return {a[0] - b[0], a[1] - b[1]};
}

double dot(const std::array<double, 2>& a, const std::array<double, 2>& b) {
  return a[0] * b[0] + a[1] * b[1];
}

/// The prism's section as a rectangle, if it is one to the engine's single precision.
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

/// Where a link's shapes stand in y and how far they reach [m].
struct Place {
  double y;
  double depth;
};

class Writer {
 public:
  Writer(const Specification& specification, std::string name, std::string mesh_folder)
      : specification_(specification),
        name_(std::move(name)),
        mesh_folder_(std::move(mesh_folder)) {}

  UrdfFiles write(const UrdfDepths& depths) {
    xml_ << "<?xml version=\"1.0\"?>\n"
            "<!-- Written by `rosrun walker_sim describe "
         << specification_.id
         << "` out of the running world; do not edit.\n"
            "     Bodies move in the plane y = 0, where their masses lie. Only what is seen and\n"
            "     collides has depth and stands beside each other. The actuators are velocity\n"
            "     motors: limit's velocity is the speed they run at, effort their torque's cap.\n"
            "     Numbers have the engine's precision, single.\n"
            "-->\n<robot name=\""
         << name_ << "\">\n";
    const std::map<std::string, Place> places = place_links(depths);
    for (const Link& link : specification_.links) write_link(link, places.at(link.name));
    for (const Joint& joint : specification_.joints) write_joint(joint);
    xml_ << "</robot>\n";
    files_.urdf = xml_.str();
    return std::move(files_);
  }

 private:
  std::map<std::string, Place> place_links(const UrdfDepths& depths) const {
    const std::string& trunk = specification_.links.front().name;
    const auto is_first = [&](const Joint& joint) { return joint.parent == trunk; };
    const auto branches =
        std::count_if(specification_.joints.begin(), specification_.joints.end(), is_first);
    const double spacing = depths.trunk + depths.limb + 2 * depths.gap;
    std::map<std::string, Place> places{{trunk, {0, depths.trunk}}};
    double y = static_cast<double>(branches + 1) / 2 * spacing;
    for (const Joint& joint : specification_.joints) {
      const auto parent = places.find(joint.parent);
      if (parent == places.end()) {
        throw std::invalid_argument("joint " + joint.name + ": unknown parent " + joint.parent);
      }
      if (is_first(joint)) y -= spacing;
      places[joint.child] = {is_first(joint) ? y : parent->second.y, depths.limb};
    }
    return places;
  }

  void write_link(const Link& link, const Place& place) {
    if (link.prisms.empty()) throw std::invalid_argument("link " + link.name + ": has no shape");
    xml_ << "  <link name=\"" << link.name << "\">\n    <inertial>\n      <origin xyz=\""
         << list(link.center_of_mass) << "\"/>\n      <mass value=\"" << text(link.mass)
         << "\"/>\n      " << inertia_element(link, place.depth) << "\n    </inertial>\n";
    for (std::size_t i = 0; i < link.prisms.size(); ++i) {
      const std::string geometry = place_shape(link, i, place);
      xml_ << "    <visual>\n"
           << geometry << "      <material name=\"" << link.name << "\">\n        <color rgba=\""
           << list(link.color) << "\"/>\n      </material>\n    </visual>\n    <collision>\n"
           << geometry << "    </collision>\n";
    }
    xml_ << "  </link>\n";
  }

  /// The elements <origin> and <geometry>; where that takes a mesh, the mesh too.
  std::string place_shape(const Link& link, std::size_t index, const Place& place) {
    const Prism& prism = link.prisms[index];
    std::string origin = "<origin xyz=\"" + list(Vector3{0, place.y, 0}) + "\"/>";
    std::string geometry;
    if (const std::optional<Rectangle> box = to_rectangle(prism)) {
      origin = "<origin xyz=\"" + list(Vector3{box->center[0], place.y, box->center[1]}) +
               "\" rpy=\"" + list(Vector3{0, box->pitch, 0}) + "\"/>";
      geometry = "<box size=\"" + list(Vector3{box->size[0], place.depth, box->size[1]}) + "\"/>";
    } else {
      const std::string number = link.prisms.size() == 1 ? "" : "_" + std::to_string(index + 1);
      const std::string file = name_ + "_" + link.name + number + ".stl";
      files_.meshes[file] = make_stl(prism, place.depth);
      geometry = "<mesh filename=\"" + mesh_folder_ + "/" + file + "\"/>";
    }
    return "      " + origin + "\n      <geometry>\n        " + geometry + "\n      </geometry>\n";
  }

  void write_joint(const Joint& joint) {
    xml_ << "  <joint name=\"" << joint.name << "\" type=\"revolute\">\n    <parent link=\""
         << joint.parent << "\"/>\n    <child link=\"" << joint.child << "\"/>\n    <origin xyz=\""
         << list(joint.origin) << "\"/>\n    <axis xyz=\"" << list(joint.axis)
         << "\"/>\n    <limit lower=\"" << text(joint.lower) << "\" upper=\"" << text(joint.upper)
         << "\" effort=\"" << text(joint.maximum_effort) << "\" velocity=\""
         << text(joint.maximum_velocity) << "\"/>\n  </joint>\n";
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

UrdfFiles make_urdf(const Specification& specification, const std::string& name,
                    const std::string& mesh_folder, const UrdfDepths& depths) {
  return Writer(specification, name, mesh_folder).write(depths);
}

}  // namespace walker
