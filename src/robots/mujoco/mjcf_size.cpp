#include "robots/mujoco/mjcf_size.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <set>
#include <string_view>
#include <vector>

namespace walker::mujoco {
namespace {

constexpr auto npos = std::string_view::npos;

/// Returns the file's text, truncated after the first block that exceeds `max_bytes`.
std::string read(const std::filesystem::path& path, std::size_t max_bytes) {
  std::string text;
  std::ifstream file(path, std::ios::binary);
  std::array<char, std::size_t{1} << 16U> block{};
  while (text.size() <= max_bytes && (file.read(block.data(), block.size()), file.gcount() > 0)) {
    text.append(block.data(), static_cast<std::size_t>(file.gcount()));
  }
  return text;
}

bool is_space(char character) { return std::isspace(static_cast<unsigned char>(character)) != 0; }

/// @param tag without its brackets, such as: include file="NAME"
/// @return NAME; empty if the tag includes no file
std::string_view included_file(std::string_view tag) {
  constexpr std::string_view kInclude = "include";
  constexpr std::string_view kFile = "file";
  if (tag.substr(0, kInclude.size()) != kInclude) return {};
  tag.remove_prefix(kInclude.size());
  if (tag.empty() || !is_space(tag[0])) return {};
  const std::size_t file = tag.find(kFile);
  if (file == npos) return {};
  const std::size_t begin = tag.find_first_of("\"'", file);
  if (begin == npos) return {};
  const std::size_t end = tag.find(tag[begin], begin + 1);
  return end == npos ? std::string_view() : tag.substr(begin + 1, end - begin - 1);
}

/// Counts a text's elements, and appends the names of the files that it includes.
std::size_t count_elements(std::string_view text, std::vector<std::string>& included) {
  std::size_t count = 0;
  for (std::size_t at = text.find('<'); at != npos; at = text.find('<', at)) {
    text.remove_prefix(at + 1);
    at = 0;
    if (text.substr(0, 3) == "!--") {
      at = text.find("-->");
    } else if (!text.empty() && std::isalpha(static_cast<unsigned char>(text[0])) != 0) {
      ++count;
      const std::string_view name = included_file(text.substr(0, text.find('>')));
      if (!name.empty()) included.emplace_back(name);
    }
    if (at == npos) break;
  }
  return count;
}

}  // namespace

MjcfSize measure_mjcf(const std::string& path, std::size_t max_bytes) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  MjcfSize size;
  std::vector<std::string> files{std::filesystem::path(path).filename()};
  std::set<std::string> known;
  while (!files.empty() && size.bytes <= max_bytes) {
    const std::string file = files.back();
    files.pop_back();
    if (!known.insert(file).second) continue;  // MuJoCo rejects a file that is included twice
    const std::string text = read(folder / file, max_bytes - size.bytes);
    size.bytes += text.size();
    size.elements += count_elements(text, files);
  }
  return size;
}

}  // namespace walker::mujoco
