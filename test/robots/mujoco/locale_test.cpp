// The process's locale does not change models or saved states.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "foreign_locale.h"
#include "robots/mujoco/model.h"
#include "robots/mujoco/model_file.h"
#include "saved_states.h"

namespace walker::mujoco {
namespace {

TEST(Locale, ChangesNoModel) {
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

TEST(Locale, ChangesNoSavedState) {
  const std::string id = "Walker2d-v5";
  const Parameters parameters{{"reset_noise_scale", 1e-3}};
  const std::vector<double> action{0.5, -0.25, 0.125, 0.5, -0.25, 0.125};
  Stepper before(id, parameters);
  before.reset(7);
  before.step(action);
  const State state = save(before);
  before.step(action);
  const ForeignLocale locale;
  Stepper after(id, parameters);
  load(after, state);
  EXPECT_EQ(save(after), state);
  after.step(action);
  expect_alike(after, before);
}

}  // namespace
}  // namespace walker::mujoco
