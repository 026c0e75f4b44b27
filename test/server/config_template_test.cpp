// The templates in config/ and docs/ros_interface.md document the parameters that the nodes read.
#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#include "agents/options.h"
#include "server/parameter_reader.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

/// One parameter of a template.
struct Entry {
  std::string value;
  std::string comment;  // above it, joined to one line
};

struct Template {
  std::string name;
  std::vector<ParameterDescription> parameters;
};

std::vector<ParameterDescription> own_parameters(const std::string& id) {
  std::vector<ParameterDescription> own = parameter_descriptions(id);
  const auto camera = server_camera_parameters(id);
  own.insert(own.end(), camera.begin(), camera.end());
  return own;
}

Template whole_template() {
  Template whole{"server", server_parameters()};
  const auto own = own_parameters("BipedalWalker-v3");
  whole.parameters.insert(whole.parameters.end(), own.begin(), own.end());
  return whole;
}

Template walker2d_template() {
  Template own{"walker2d", own_parameters("Walker2d-v5")};
  ParameterDescription id = server_parameters().front();
  id.default_value = std::string("Walker2d-v5");
  own.parameters.push_back(id);
  return own;
}

std::map<std::string, Entry> read_template(const std::string& name) {
  std::ifstream file(std::string(WALKER_SIM_SOURCE_DIR) + "/config/" + name + ".yaml");
  EXPECT_TRUE(file) << "config/" << name << ".yaml cannot be read";
  std::map<std::string, Entry> entries;
  std::string comment;
  for (std::string line; std::getline(file, line);) {
    if (line.empty()) {
      comment.clear();
    } else if (line[0] == '#') {
      comment += line.substr(1);
    } else {
      const std::size_t colon = line.find(": ");
      entries[line.substr(0, colon)] = {line.substr(colon + 2), comment};
    }
  }
  return entries;
}

/// 15 significant digits: the stream's default of 6 would print 1000000 as 1e+06.
std::string plain(double number) {
  constexpr int kDigits = 15;
  std::ostringstream text;
  text.precision(kDigits);
  text << number;
  return text.str();
}

/// " [unit] minimum .. maximum", without the parts that the parameter lacks.
std::string limits(const ParameterDescription& parameter) {
  std::string text = parameter.unit.empty() ? "" : " [" + parameter.unit + "]";
  const bool is_number = std::holds_alternative<std::int64_t>(parameter.default_value) ||
                         std::holds_alternative<double>(parameter.default_value) ||
                         std::holds_alternative<std::vector<double>>(parameter.default_value);
  if (is_number) text += " " + plain(parameter.minimum) + " .. " + plain(parameter.maximum);
  return text;
}

std::string default_text(const ParameterDescription& parameter) {
  const std::string text = to_string(parameter.default_value);
  return text.empty() ? "\"\"" : text;
}

class ConfigTemplate : public testing::TestWithParam<Template> {};

TEST_P(ConfigTemplate, HasExactlyTheParametersWithDefaultUnitAndRange) {
  std::map<std::string, Entry> entries = read_template(GetParam().name);
  for (const ParameterDescription& parameter : GetParam().parameters) {
    ASSERT_EQ(entries.count(parameter.name), 1U) << parameter.name << " is missing";
    const Entry entry = entries[parameter.name];
    EXPECT_EQ(entry.value, default_text(parameter)) << parameter.name;
    const std::string expected = " " + parameter.description + limits(parameter);
    EXPECT_EQ(entry.comment.substr(0, expected.size()), expected) << parameter.name;
    entries.erase(parameter.name);
  }
  for (const auto& [name, entry] : entries) ADD_FAILURE() << name << " is no parameter";
}

INSTANTIATE_TEST_SUITE_P(Templates, ConfigTemplate,
                         testing::Values(whole_template(), walker2d_template(),
                                         Template{"agent", agent_parameters()}),
                         [](const testing::TestParamInfo<Template>& instance) {
                           return instance.param.name;
                         });

/// The documentation's table has a row of these words for each of the server's own parameters.
TEST(Documentation, HasTheServersParameters) {
  std::ifstream file(WALKER_SIM_SOURCE_DIR "/docs/ros_interface.md");
  const std::string page{std::istreambuf_iterator<char>(file), {}};
  for (const ParameterDescription& parameter : server_parameters()) {
    const std::string row = "\n| `" + parameter.name + "` | `" + default_text(parameter) + "` | " +
                            parameter.description + limits(parameter) + " |\n";
    EXPECT_NE(page.find(row), std::string::npos) << row;
  }
}

}  // namespace
}  // namespace walker
