// Shared by the tests of drawings and markers.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "drawing/drawing.h"
#include "stepper.h"
#include "walker_sim/registry.h"
#include "walker_sim/sensors.h"

namespace walker::test {

inline bool is_finite(const Vector3& point) {
  return std::all_of(point.begin(), point.end(), [](double value) { return std::isfinite(value); });
}

inline std::size_t points_per_element(Drawing::Kind kind) {
  if (kind == Drawing::Kind::triangles) return 3;
  return kind == Drawing::Kind::lines ? 2 : 1;
}

/// Viewers reject invalid shapes or crash on them.
inline void expect_drawable(const Drawing& drawing) {
  SCOPED_TRACE(drawing.name);
  EXPECT_GT(drawing.size, 0);
  EXPECT_GT(drawing.color[3], 0);
  EXPECT_EQ(drawing.points.size() % points_per_element(drawing.kind), 0U);
  EXPECT_TRUE(std::all_of(drawing.points.begin(), drawing.points.end(), is_finite));
  EXPECT_TRUE(drawing.colors.empty() || drawing.colors.size() == drawing.points.size());
  for (const Color& color : drawing.colors) {
    for (const double part : color) EXPECT_TRUE(part >= 0 && part <= 1) << part;
  }
}

inline const Drawing* find(const std::vector<Drawing>& drawings, const std::string& name) {
  const auto found = std::find_if(drawings.begin(), drawings.end(),
                                  [&](const Drawing& drawing) { return drawing.name == name; });
  return found == drawings.end() ? nullptr : &*found;
}

/// A walker just after a reset.
struct ShownWalker {
  explicit ShownWalker(const std::string& id) : stepper(id) {
    stepper.reset(0);
    stepper.environment->sense(sensors);
    stepper.environment->scene(scene);
  }

  const Specification& specification() const { return stepper.environment->specification(); }
  std::vector<Drawing> state() const { return state_drawings(specification(), sensors, "a text"); }

  Stepper stepper;
  Sensors sensors;
  Scene scene;
};

inline std::vector<std::string> ids() {
  std::vector<std::string> ids;
  for (const Registration& registration : registrations()) ids.push_back(registration.id);
  return ids;
}

}  // namespace walker::test
