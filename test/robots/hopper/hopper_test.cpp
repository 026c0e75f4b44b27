// What Hopper adds to the MuJoCo robots: its model, parameters and healthy ranges.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "error_message.h"
#include "stepper.h"

namespace walker::hopper {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

using List = std::vector<double>;

TEST(Hopper, RejectsWalker2dsModel) {
  EXPECT_EQ(message_of<std::invalid_argument>([] {
              make("Hopper-v5", {{"xml_file", std::string("walker2d_v5.xml")}});
            }),
            "parameter xml_file = walker2d_v5.xml: nq = 9, nv = 9, nu = 6, na = 0; must be nq = nv "
            "= 6, nu = 3, na = 0, as in hopper_v5.xml");
  // Walker2d also rejects Hopper's model, even if it is already compiled.
  const auto hopper = make("Hopper-v5");
  EXPECT_THROW(make("Walker2d-v5", {{"xml_file", std::string("hopper_v5.xml")}}),
               std::invalid_argument);
}

std::string end_of(const Parameters& parameters) {
  Stepper hopper("Hopper-v5", parameters);
  hopper.reset(0);
  while (!hopper.has_ended()) hopper.step({1, 1, 1});
  return hopper.result.end_reason;
}

TEST(Hopper, EndsWhereARangeIsLeft) {
  const Parameters wide{{"healthy_state_range", List{-1e9, 1e9}},
                        {"healthy_z_range", List{-1e9, 1e9}},
                        {"healthy_angle_range", List{-1e9, 1e9}}};
  const auto with = [&wide](const char* name, double low, double high) {
    Parameters parameters = wide;
    parameters[name] = List{low, high};
    return parameters;
  };
  EXPECT_EQ(end_of(wide), "1000 steps");
  EXPECT_EQ(end_of(with("healthy_state_range", -2, 2)),
            "a number of the state left healthy_state_range");
  EXPECT_EQ(end_of(with("healthy_z_range", 0.7, kInfinity)),
            "the torso's height left healthy_z_range");
  EXPECT_EQ(end_of(with("healthy_angle_range", -0.2, 0.2)),
            "the torso's angle left healthy_angle_range");
}

/// The range does not apply to x and z.
TEST(Hopper, StateRangeBeginsAtTheTorsosAngle) {
  Stepper hopper("Hopper-v5", {{"healthy_state_range", List{-1.0, 1.0}}});
  hopper.reset(0);
  hopper.step({0, 0, 0});
  EXPECT_GT(hopper.info[0] + 1.25, 1) << "the torso's height, above the range";
  EXPECT_FALSE(hopper.has_ended());
}

}  // namespace
}  // namespace walker::hopper
