#include "description/stl.h"

#include <array>
#include <cstdint>
#include <cstring>
#include <vector>

#include "description/planar_shapes.h"

namespace walker {
namespace {

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
