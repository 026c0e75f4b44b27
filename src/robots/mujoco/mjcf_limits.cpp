#include "robots/mujoco/mjcf_limits.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <vector>

#include "base/parameter_text.h"
#include "base/printable_text.h"

namespace walker::mujoco {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxBytes = std::uintmax_t{64} << 20U;
constexpr int kMaxElements = 20000;  // MuJoCo's compile time is quadratic in their number
constexpr double kMaxCells = 2e8;    // up to 8 bytes each

struct Range {
  int min;
  int max;
};

/// Returns the allowed values of an attribute, if they are limited. It does not depend on the
/// element, because no other element has larger values for one of these names.
std::optional<Range> range_of(std::string_view attribute) {
  constexpr Range kIterations{0, 10000};
  constexpr Range kPixels{1, 16384};
  constexpr Range kFacets{1, 1000};
  constexpr Range kSide{0, 32768};
  static const std::map<std::string_view, Range> kRanges{
      {"iterations", kIterations},
      {"noslip_iterations", kIterations},
      {"mpr_iterations", kIterations},
      {"offwidth", kPixels},
      {"offheight", kPixels},
      {"shadowsize", {0, kPixels.max}},
      {"offsamples", {0, 64}},
      {"numslices", kFacets},
      {"numstacks", kFacets},
      {"numquads", kFacets},
      {"nstack", {-1, 250000000}},
      {"njmax", {-1, 10000}},
      {"nconmax", {-1, 100000}},
      {"nkey", {0, 10000}},
      {"nuserdata", {0, 1000000}},
      {"dim", {1, 100000}},
      {"nrow", kSide},
      {"ncol", kSide},
      {"width", kSide},
      {"height", kSide},
  };
  if (attribute.substr(0, 6) == "nuser_") return Range{-1, 1000};
  const auto found = kRanges.find(attribute);
  return found == kRanges.end() ? std::nullopt : std::optional(found->second);
}

// ---------------------------------------------------------------- XML

struct Element {
  std::string_view name;
  std::map<std::string_view, std::string_view> attributes;

  std::string_view attribute(std::string_view key) const {
    const auto found = attributes.find(key);
    return found == attributes.end() ? std::string_view() : found->second;
  }
  /// Returns the attribute as a number; NaN: it is none, 0: it is absent.
  double number(std::string_view key) const {
    if (attributes.count(key) == 0) return 0;
    return parse_number(std::string(attribute(key)))
        .value_or(std::numeric_limits<double>::quiet_NaN());
  }
};

/// Removes and returns the text before the first of some characters.
std::string_view take_until(std::string_view& text, std::string_view ends) {
  const std::string_view taken = text.substr(0, text.find_first_of(ends));
  text.remove_prefix(taken.size());
  return taken;
}

/// Removes and returns an element's tag, whose '<' the text does not have any more.
Element take_element(std::string_view& text) {
  constexpr std::string_view kBetween = " \t\r\n/";
  Element element{take_until(text, " \t\r\n/>"), {}};
  while (true) {
    text.remove_prefix(std::min(text.find_first_not_of(kBetween), text.size()));
    if (text.empty() || text[0] == '>') return element;
    const std::string_view name = take_until(text, " \t\r\n=");
    take_until(text, "\"'");
    if (text.empty()) return element;
    const std::string_view quote = text.substr(0, 1);
    text.remove_prefix(1);
    element.attributes.emplace(name, take_until(text, quote));
    text.remove_prefix(std::min<std::size_t>(1, text.size()));
  }
}

/// Returns what ends a comment, CDATA or the like that begins here, without its '<'; empty: an
/// element.
std::string_view end_of_markup(std::string_view text) {
  constexpr std::array<std::array<std::string_view, 2>, 4> kMarkups{
      {{"!--", "-->"}, {"![CDATA[", "]]>"}, {"!", ">"}, {"?", "?>"}}};
  for (const auto& [begin, end] : kMarkups) {
    if (text.substr(0, begin.size()) == begin) return end;
  }
  return {};
}

// ---------------------------------------------------------------- the check

class Check {
 public:
  explicit Check(const fs::path& path) : folder_(path.parent_path()), texts_{path.filename()} {}

  void run() {
    std::set<std::string> known;
    while (!texts_.empty()) {
      const std::string name = texts_.back();
      texts_.pop_back();
      if (known.insert(name).second) check_text(name);  // MuJoCo rejects a second inclusion
    }
    for (const std::string& folder : asset_folders_) {
      for (const std::string& asset : assets_) {
        if (size_of(folder_ / folder / asset) > kMaxBytes) {
          throw std::runtime_error(printable(asset) + ": must have at most " +
                                   std::to_string(kMaxBytes) + " bytes");
        }
      }
    }
  }

 private:
  /// Returns the file's size; 0: there is no such file.
  static std::uintmax_t size_of(const fs::path& path) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (!fs::exists(status)) return 0;
    if (!fs::is_regular_file(status)) {
      throw std::runtime_error(printable(path.filename().string()) + ": must be a regular file");
    }
    return fs::file_size(path, error);
  }

  void check_text(const std::string& name) {
    const std::uintmax_t size = size_of(folder_ / name);
    bytes_ += size;
    if (bytes_ > kMaxBytes) {
      throw std::runtime_error("has " + std::to_string(bytes_) +
                               " bytes, included files counted; must have at most " +
                               std::to_string(kMaxBytes));
    }
    std::string content(size, ' ');
    std::ifstream(folder_ / name, std::ios::binary)
        .read(content.data(), static_cast<std::streamsize>(size));
    std::string_view text = content;
    while (take_until(text, "<"), !text.empty()) {
      text.remove_prefix(1);
      if (const std::string_view end = end_of_markup(text); !end.empty()) {
        text.remove_prefix(std::min(text.find(end), text.size()));
      } else if (!text.empty() && std::isalpha(static_cast<unsigned char>(text[0])) != 0) {
        check_element(take_element(text));
      }
    }
  }

  void check_element(const Element& element) {
    if (++num_elements_ > kMaxElements) {
      throw std::runtime_error("must have at most " + std::to_string(kMaxElements) +
                               " elements, included files counted");
    }
    // Both can take MuJoCo hours, and no planar robot has joints of composites or muscles.
    if (element.name == "composite" || element.name == "lengthrange") {
      throw std::runtime_error("must not have an element " + std::string(element.name));
    }
    for (const auto& [name, value] : element.attributes) {
      check_range(element, name);
      if (name == "meshdir" || name == "texturedir") asset_folders_.emplace(value);
      if (name.substr(0, 4) != "file") continue;  // a cube's textures: fileright, fileup ...
      (element.name == "include" ? texts_ : assets_).emplace_back(value);
    }
    count_cells(element);
  }

  static void check_range(const Element& element, std::string_view name) {
    const std::optional<Range> range = range_of(name);
    if (!range) return;
    const double value = element.number(name);
    if (range->min <= value && value <= range->max) return;
    throw std::runtime_error(std::string(element.name) + " " + std::string(name) + " = " +
                             printable(element.attribute(name)) + ": must be between " +
                             std::to_string(range->min) + " and " + std::to_string(range->max));
  }

  void count_cells(const Element& element) {
    const double width = element.number("width");
    const double height = element.number("height");
    const bool is_flat = element.attribute("type") == "2d";
    const double side = std::max(width, height);
    num_cells_ += element.number("nrow") * element.number("ncol") +
                  (is_flat ? width * height : 6 * side * side);
    if (num_cells_ <= kMaxCells) return;
    throw std::runtime_error("must have at most " +
                             std::to_string(static_cast<std::int64_t>(kMaxCells)) +
                             " pixels of textures and points of height fields");
  }

  fs::path folder_;
  std::vector<std::string> texts_;  // still to be read
  std::vector<std::string> assets_;
  std::set<std::string> asset_folders_{""};
  std::uintmax_t bytes_ = 0;
  int num_elements_ = 0;
  double num_cells_ = 0;
};

}  // namespace

void check_mjcf(const std::string& path) { Check(path).run(); }

}  // namespace walker::mujoco
