// Our compiled models against Gymnasium's, field by field, bit by bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <iomanip>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "foreign_locale.h"
#include "recording.h"
#include "robots/mujoco/model.h"
#include "robots/mujoco/model_file.h"
#include "test_name.h"

#include <mujoco/mjxmacro.h>

namespace walker::mujoco {
namespace {

/// Values by field, as in a recording: integers in decimal, doubles as hexadecimal bits.
using Fields = std::map<std::string, std::vector<std::string>>;

/// Returns the fields that differ on purpose, with the reasons. All other fields are compared.
std::map<std::string, std::string> different_fields(const std::string& id) {
  const char* const pairs = "pairs say which geoms can touch, so that no others are tried";
  const char* const sizes = "the buffers have the sizes that those pairs can need";
  const char* const names = "where names are stored; the names themselves are compared";
  const char* const looks = "a texture and a material that no geom has, and a light's -0";
  std::map<std::string, std::string> fields = {
      {"npair", pairs},           {"opt.collision", pairs}, {"pair_dim", pairs},
      {"pair_geom1", pairs},      {"pair_geom2", pairs},    {"pair_signature", pairs},
      {"pair_solref", pairs},     {"pair_solimp", pairs},   {"pair_margin", pairs},
      {"pair_gap", pairs},        {"pair_friction", pairs}, {"njmax", sizes},
      {"nconmax", sizes},         {"nstack", sizes},        {"nbuffer", sizes},
      {"names", names},           {"nnames", names},        {"name_pairadr", names},
      {"name_actuatoradr", names}};
  if (id.rfind("Walker2d", 0) == 0) {
    for (const char* const name :
         {"ntex", "ntexdata", "nmat", "tex_type", "tex_height", "tex_width", "tex_adr", "tex_rgb",
          "mat_texid", "mat_texuniform", "mat_texrepeat", "mat_emission", "mat_specular",
          "mat_shininess", "mat_reflectance", "mat_rgba", "light_dir", "light_dir0"}) {
      fields[name] = looks;
    }
    fields["name_texadr"] = names;
    fields["name_matadr"] = names;
  }
  return fields;
}

/// Texts and textures, which are not recorded.
const std::set<std::string>& unrecorded_fields() {
  static const std::set<std::string> fields = {"names", "text_data", "tex_rgb"};
  return fields;
}

std::string word(int value) { return std::to_string(value); }

std::string word(double value) {
  std::ostringstream text;
  text << std::hex << std::setw(16) << std::setfill('0') << to_bits(value);
  return text.str();
}

template <typename T>
std::vector<std::string> words(const T* values, int count) {
  std::vector<std::string> result(count);
  std::transform(values, values + count, result.begin(), [](T value) { return word(value); });
  return result;
}

std::vector<std::string> names(const mjModel& model, mjtObj kind, int count) {
  std::vector<std::string> result;
  for (int i = 0; i < count; ++i) {
    const char* const name = mj_id2name(&model, kind, i);
    result.emplace_back(name == nullptr ? "-" : name);
  }
  return result;
}

/// Returns all fields, by the X macros of mjxmacro.h.
Fields fields_of(const mjModel& model) {
  Fields fields;
#define X(name) fields[#name] = words(&model.name, 1);
  MJMODEL_INTS
#undef X
#define X(type, name) fields["opt." #name] = words(&model.opt.name, 1);
  MJOPTION_SCALARS
#undef X
#define X(name, count) fields["opt." #name] = words(&model.opt.name[0], count);
  MJOPTION_VECTORS
#undef X
  MJMODEL_POINTERS_PREAMBLE((&model))
#define X(type, name, rows, columns) fields[#name] = words(model.name, model.rows * (columns));
  MJMODEL_POINTERS
#undef X
  // mjxmacro.h has no list of these fields.
  fields["stat.meaninertia"] = words(&model.stat.meaninertia, 1);
  fields["stat.meanmass"] = words(&model.stat.meanmass, 1);
  fields["stat.meansize"] = words(&model.stat.meansize, 1);
  fields["stat.extent"] = words(&model.stat.extent, 1);
  fields["stat.center"] = words(&model.stat.center[0], 3);
  fields["names.body"] = names(model, mjOBJ_BODY, model.nbody);
  fields["names.joint"] = names(model, mjOBJ_JOINT, model.njnt);
  fields["names.geom"] = names(model, mjOBJ_GEOM, model.ngeom);
  fields["names.actuator"] = names(model, mjOBJ_ACTUATOR, model.nu);
  return fields;
}

std::map<std::string, Fields> recorded_models(const std::string& robot) {
  Recording recording(robot + "_models.txt");
  std::map<std::string, Fields> models;
  Fields* fields = nullptr;
  while (recording.has_more()) {
    const auto name = recording.next<std::string>();
    if (name == "model") {
      fields = &models[recording.next<std::string>()];
      continue;
    }
    std::vector<std::string>& values = (*fields)[name];
    values.resize(recording.next<std::size_t>());
    for (std::string& value : values) value = recording.next<std::string>();
  }
  return models;
}

/// Gymnasium's environment, and our model.
class Models : public testing::TestWithParam<std::pair<const char*, const char*>> {
 protected:
  const std::string robot =
      std::string(GetParam().second).substr(0, std::string(GetParam().second).find('_'));
  const Fields theirs = recorded_models(robot).at(GetParam().first);
  const std::map<std::string, std::string> different = different_fields(GetParam().first);
  const Fields ours = fields_of(*load_model(GetParam().second));
};

TEST_P(Models, EqualGymnasiums) {
  std::size_t compared = 0;
  for (const auto& [name, values] : ours) {
    if (different.count(name) != 0 || unrecorded_fields().count(name) != 0) continue;
    ASSERT_EQ(theirs.count(name), 1U) << name << " is not recorded";
    const std::vector<std::string>& expected = theirs.at(name);
    ASSERT_EQ(values.size(), expected.size()) << name;
    for (std::size_t i = 0; i < values.size(); ++i) {
      EXPECT_EQ(values[i], expected[i]) << name << "[" << i << "]";
    }
    compared += values.size();
  }
  EXPECT_GT(compared, robot == "walker2d" ? 1500U : 1000U);
}

/// Every field in the list of differences differs, and every recorded field is a field of ours.
TEST_P(Models, DifferInTheListedFields) {
  for (const auto& [name, reason] : different) {
    ASSERT_EQ(ours.count(name), 1U) << name;
    if (unrecorded_fields().count(name) != 0) continue;
    EXPECT_NE(ours.at(name), theirs.at(name)) << name << " does not differ: " << reason;
  }
  for (const auto& [name, values] : theirs) EXPECT_EQ(ours.count(name), 1U) << name;
}

INSTANTIATE_TEST_SUITE_P(Robots, Models,
                         testing::Values(std::pair("Walker2d-v4", "walker2d_v4.xml"),
                                         std::pair("Walker2d-v5", "walker2d_v5.xml"),
                                         std::pair("Hopper-v4", "hopper_v4.xml"),
                                         std::pair("Hopper-v5", "hopper_v5.xml")),
                         [](const auto& test) { return test_name(test.param.first); });

/// Negative control of the comparison above.
TEST(RecordedModels, DifferInTheRightFootsFriction) {
  const std::map<std::string, Fields> recorded = recorded_models("walker2d");
  std::set<std::string> differing;
  for (const auto& [name, values] : recorded.at("Walker2d-v4")) {
    if (values != recorded.at("Walker2d-v5").at(name)) differing.insert(name);
  }
  EXPECT_EQ(differing, std::set<std::string>{"geom_friction"});
}

/// A model depends neither on the process's locale nor on whether it is built in or a file.
TEST(Fingerprints, DoNotDependOnTheLocale) {
  const Folder folder;
  const std::string file = folder.write("model.xml", builtin_text("walker2d_v5.xml"));
  const auto fingerprint_of = [](const std::string& name) {
    return fingerprint(*load_model(name));  // compiles anew, because nothing keeps the model
  };
  const std::uint64_t walker = fingerprint_of("walker2d_v5.xml");
  const std::uint64_t hopper = fingerprint_of("hopper_v5.xml");
  const ForeignLocale locale;
  EXPECT_EQ(fingerprint_of("walker2d_v5.xml"), walker);
  EXPECT_EQ(fingerprint_of("hopper_v5.xml"), hopper);
  EXPECT_EQ(fingerprint_of(file), walker);
}

}  // namespace
}  // namespace walker::mujoco
