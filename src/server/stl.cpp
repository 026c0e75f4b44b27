#include "server/stl.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

namespace walker {
namespace {

using Triangle = std::array<Vector3, 3>;

/// Little-endian on every machine.
void append(std::uint32_t value, std::size_t bytes, std::string& file) {
  constexpr unsigned kByte = 0xFF;
  constexpr unsigned kBits = 8;
  for (std::size_t i = 0; i < bytes; ++i) {
    file.push_back(static_cast<char>((value >> (kBits * i)) & kByte));
  }
}

void append(const Vector3& vector, std::string& file) {
  for (const double coordinate : vector) {
    const auto single = static_cast<float>(coordinate);
    std::uint32_t bits = 0;
    static_assert(sizeof(bits) == sizeof(single), "STL holds IEEE singles");
    std::memcpy(&bits, &single, sizeof(bits));
    append(bits, sizeof(bits), file);
  }
}

/// Unit vector to the side from which the corners run counter-clockwise.
Vector3 normal_of(const Triangle& t) {
  Vector3 a{};
  Vector3 b{};
  for (std::size_t i = 0; i < a.size(); ++i) {
    a[i] = t[1][i] - t[0][i];
    b[i] = t[2][i] - t[0][i];
  }
  const Vector3 cross{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                      a[0] * b[1] - a[1] * b[0]};
  // Not hypot: its last bit differs between C libraries.
  const double length = std::sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]);
  if (length == 0) return {};
  return {cross[0] / length, cross[1] / length, cross[2] / length};
}

std::vector<Triangle> surface_of(const Prism& prism, double depth) {
  // The vertices run counter-clockwise seen from -y.
  const auto near = [&](std::size_t i) {
    return Vector3{prism.vertices[i][0], -depth / 2, prism.vertices[i][1]};
  };
  const auto far = [&](std::size_t i) {
    return Vector3{prism.vertices[i][0], depth / 2, prism.vertices[i][1]};
  };
  std::vector<Triangle> triangles;
  const std::size_t count = prism.vertices.size();
  for (std::size_t i = 1; i + 1 < count; ++i) {
    triangles.push_back({near(0), near(i), near(i + 1)});
    triangles.push_back({far(0), far(i + 1), far(i)});
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t next = (i + 1) % count;
    triangles.push_back({near(i), far(i), far(next)});
    triangles.push_back({near(i), far(next), near(next)});
  }
  return triangles;
}

}  // namespace

std::string make_stl(const Prism& prism, double depth) {
  constexpr std::size_t kHeaderSize = 80;
  constexpr std::size_t kAttributeSize = 2;
  const std::vector<Triangle> triangles = surface_of(prism, depth);
  // Must not begin with "solid": readers would take the file for a text.
  std::string file = "binary STL of walker_sim, metres";
  file.resize(kHeaderSize, ' ');
  append(static_cast<std::uint32_t>(triangles.size()), sizeof(std::uint32_t), file);
  for (const Triangle& triangle : triangles) {
    append(normal_of(triangle), file);
    for (const Vector3& corner : triangle) append(corner, file);
    append(0, kAttributeSize, file);
  }
  return file;
}

}  // namespace walker
