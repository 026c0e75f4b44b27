// The floor that a level replaces: what its contacts keep, and models without one.
#include "robots/mujoco/floor.h"

#include <gtest/gtest.h>

#include <iterator>
#include <string>
#include <vector>

#include "robots/mujoco/model.h"
#include "robots/mujoco/model_file.h"
#include "robots/mujoco/on_line.h"
#include "robots/mujoco/planar_model.h"

namespace walker::mujoco {
namespace {

constexpr double kPi = 3.141592653589793;

/// Friction and softness are the floor's, whether the model names pairs or the engine finds them.
TEST(FloorTest, ContactsHaveTheFloorsParameters) {
  const Folder folder;
  const std::string stock = stock_text("walker2d_v5.xml");
  const std::string floor = "<geom name=\"floor\"";
  const std::string texts[] = {
      builtin_text("walker2d_v5.xml"),
      builtin_text("walker2d_v4.xml"),
      replaced(builtin_text("walker2d_v5.xml"), " collision=\"predefined\"", ""),
      stock,
      replaced(stock, "integrator=\"RK4\"", "integrator=\"RK4\" collision=\"dynamic\""),
      replaced(stock, floor, floor + " priority=\"1\" condim=\"6\" margin=\"0.002\""),
      replaced(stock, floor, floor + " priority=\"-1\" solref=\"0.03 0.7\""),
      replaced(stock, floor, floor + " solmix=\"3\" solref=\"0.03 0.7\" solimp=\"0.7 0.8 0.01\""),
      replaced(stock, floor, floor + " solmix=\"0\" solref=\"-900 -30\" gap=\"0.0001\""),
  };
  for (std::size_t i = 0; i < std::size(texts); ++i) {
    SCOPED_TRACE(i);
    const std::string file = folder.write("model" + std::to_string(i) + ".xml", texts[i]);
    const ModelPointer model = load_planar_model({file, 6, "walker2d_v5.xml"});
    ASSERT_EQ(level_refusal(*model), "");
    EXPECT_EQ(geoms_on_floor(*model).size(), 7U);
    const auto level = on_line(model, line_of({{-50, 0}, {1, 0}, {1, -0.5}, {9, -0.5}}));
    LibraryPhysics flat(model);
    State position(model->nq);
    for (const double height : {1.2, 0.035}) {
      position[kBaseZ] = height;
      position[kBasePitch] = height < 0.5 ? kPi / 2 : 0;
      for (LibraryPhysics* each : {&flat, level.get()}) {
        each->reset(position.data(), State(model->nv).data());
      }
      const std::vector<mjContact> expected = contacts_of(flat);
      const std::vector<mjContact> contacts = contacts_of(*level);
      EXPECT_GE(expected.size(), height < 0.5 ? 6U : 2U);
      ASSERT_EQ(contacts.size(), expected.size());
      for (std::size_t k = 0; k < contacts.size(); ++k) {
        EXPECT_EQ(numbers_of(contacts[k]), numbers_of(expected[k])) << height;
      }
    }
  }
}

TEST(FloorTest, AModelWithoutAFloorIsRefused) {
  const Folder folder;
  const std::string text = stock_text("walker2d_v5.xml");
  const auto refusal = [&](const std::string& name, const std::string& changed) {
    return level_refusal(*load_model(folder.write(name + ".xml", changed)));
  };
  EXPECT_EQ(refusal("tilted",
                    replaced(text, "<geom name=\"floor\"", "<geom name=\"floor\" euler=\"0 3 0\"")),
            "the model has no floor, a level plane of the world's body");
  EXPECT_EQ(refusal("box", replaced(text, "type=\"plane\" size=\"40 40 40\"",
                                    "type=\"box\" size=\"40 40 0.1\" pos=\"0 0 -0.1\"")),
            "the model has no floor, a level plane of the world's body");
  EXPECT_EQ(
      refusal("sole", replaced(text, "name=\"foot_geom\"", "name=\"sole\" type=\"cylinder\"")),
      "the geom sole touches the floor and has another shape than a sphere or a capsule, which "
      "alone stand on a level");
  EXPECT_EQ(refusal("untouched", replaced(text, "conaffinity=\"1\"", "conaffinity=\"0\"")),
            "no limb of the model touches its floor");
}

}  // namespace
}  // namespace walker::mujoco
