#include "description/collada.h"

#include <sstream>
#include <vector>

#include "description/planar_shapes.h"
#include "description/urdf_text.h"

namespace walker {
namespace {

// Of the colour, how much a face has without light. rviz's only light comes from the viewer, so
// that the faces seen from the side would be black.
constexpr double kOwnShine = 0.7;

/// A source of one vector per corner of the triangles.
void write_source(const char* name, const std::vector<Vector3>& vectors, std::ostream& xml) {
  xml << "    <source id=\"" << name << "\">\n     <float_array id=\"" << name
      << "_values\" count=\"" << 3 * vectors.size() << "\">";
  const char* separator = "";
  for (const Vector3& vector : vectors) {
    xml << separator << list_text(vector, Precision::in_single);
    separator = " ";
  }
  xml << "</float_array>\n     <technique_common><accessor source=\"#" << name
      << "_values\" count=\"" << vectors.size()
      << "\" stride=\"3\"><param name=\"X\" type=\"float\"/><param name=\"Y\" type=\"float\"/>"
         "<param name=\"Z\" type=\"float\"/></accessor></technique_common>\n    </source>\n";
}

std::string color_element(const Color& color, double factor) {
  const Color part{factor * color[0], factor * color[1], factor * color[2], 1};
  return "<color>" + list_text(part, Precision::in_single) + "</color>";
}

void write_geometry(const std::vector<Triangle>& triangles, std::ostream& xml) {
  std::vector<Vector3> corners;
  std::vector<Vector3> normals;
  for (const Triangle& triangle : triangles) {
    corners.insert(corners.end(), triangle.begin(), triangle.end());
    normals.insert(normals.end(), triangle.size(), normal_of(triangle));
  }
  xml << "  <geometry id=\"mesh\"><mesh>\n";
  write_source("corners", corners, xml);
  write_source("normals", normals, xml);
  xml << "    <vertices id=\"vertices\"><input semantic=\"POSITION\" source=\"#corners\"/>"
         "</vertices>\n    <triangles count=\""
      << triangles.size()
      << "\" material=\"color\"><input semantic=\"VERTEX\" source=\"#vertices\" offset=\"0\"/>"
         "<input semantic=\"NORMAL\" source=\"#normals\" offset=\"0\"/><p>";
  for (std::size_t i = 0; i < corners.size(); ++i) xml << (i == 0 ? "" : " ") << i;
  xml << "</p></triangles>\n  </mesh></geometry>\n";
}

}  // namespace

std::string make_collada(const Prism& prism, double depth, const Color& color) {
  std::ostringstream xml;
  xml << "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
         "<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">\n"
         " <asset><unit name=\"meter\" meter=\"1\"/><up_axis>Z_UP</up_axis></asset>\n"
         " <library_effects><effect id=\"effect\"><profile_COMMON><technique sid=\"common\">"
         "<lambert>\n  <emission>"
      << color_element(color, kOwnShine) << "</emission>\n  <diffuse>"
      << color_element(color, 1 - kOwnShine)
      << "</diffuse>\n </lambert></technique></profile_COMMON></effect></library_effects>\n"
         " <library_materials><material id=\"material\"><instance_effect url=\"#effect\"/>"
         "</material></library_materials>\n <library_geometries>\n";
  write_geometry(surface_of(prism, depth), xml);
  xml << " </library_geometries>\n"
         " <library_visual_scenes><visual_scene id=\"scene\"><node id=\"node\">"
         "<instance_geometry url=\"#mesh\"><bind_material><technique_common>"
         "<instance_material symbol=\"color\" target=\"#material\"/></technique_common>"
         "</bind_material></instance_geometry></node></visual_scene></library_visual_scenes>\n"
         " <scene><instance_visual_scene url=\"#scene\"/></scene>\n</COLLADA>\n";
  return xml.str();
}

}  // namespace walker
