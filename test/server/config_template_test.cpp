// config/server.yaml documents exactly the parameters that the server takes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#include "server/parameter_reader.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

/// One parameter of the template, and the comment above it in one line.
struct Entry {
  std::string name;
  std::string value;
  std::string comment;
};

std::vector<Entry> read_template() {
  std::ifstream file(std::string(WALKER_SIM_SOURCE_DIR) + "/config/server.yaml");
  EXPECT_TRUE(file) << "config/server.yaml cannot be read";
  std::vector<Entry> entries;
  std::string comment;
  for (std::string line; std::getline(file, line);) {
    if (line.empty()) {
      comment.clear();
    } else if (line[0] == '#') {
      comment += line.substr(1);
    } else {
      const std::size_t colon = line.find(": ");
      entries.push_back({line.substr(0, colon), line.substr(colon + 2), comment});
    }
  }
  return entries;
}

std::vector<ParameterDescription> all_parameters() {
  std::vector<ParameterDescription> all = server_parameters();
  const auto own = parameter_descriptions("BipedalWalker-v3");
  all.insert(all.end(), own.begin(), own.end());
  return all;
}

/// As one writes it: neither an exponent nor an idle point.
std::string plain(double number) {
  constexpr int kDigits = 15;
  std::ostringstream text;
  text.precision(kDigits);
  text << number;
  return text.str();
}

/// " [unit] minimum .. maximum", as far as the parameter has them.
std::string limits(const ParameterDescription& parameter) {
  std::string text = parameter.unit.empty() ? "" : " [" + parameter.unit + "]";
  const bool is_number = std::holds_alternative<std::int64_t>(parameter.default_value) ||
                         std::holds_alternative<double>(parameter.default_value);
  if (is_number) text += " " + plain(parameter.minimum) + " .. " + plain(parameter.maximum);
  return text;
}

std::string default_text(const ParameterDescription& parameter) {
  const std::string text = to_string(parameter.default_value);
  return text.empty() ? "\"\"" : text;
}

TEST(ConfigTemplate, HasEachParameterWithItsDefaultUnitAndRange) {
  const std::vector<Entry> entries = read_template();
  for (const ParameterDescription& parameter : all_parameters()) {
    const auto entry = std::find_if(entries.begin(), entries.end(), [&](const Entry& candidate) {
      return candidate.name == parameter.name;
    });
    ASSERT_NE(entry, entries.end()) << parameter.name << " is missing";
    EXPECT_EQ(entry->value, default_text(parameter)) << parameter.name;
    const std::string expected = " " + parameter.description + limits(parameter);
    EXPECT_EQ(entry->comment.substr(0, expected.size()), expected) << parameter.name;
  }
}

TEST(ConfigTemplate, HasNoOthers) {
  const std::vector<ParameterDescription> known = all_parameters();
  for (const Entry& entry : read_template()) {
    EXPECT_TRUE(std::any_of(known.begin(), known.end(), [&](const ParameterDescription& parameter) {
      return parameter.name == entry.name;
    })) << entry.name;
  }
}

}  // namespace
}  // namespace walker
