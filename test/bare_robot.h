// Base class of the robots that tests define.
#pragma once

#include <stdexcept>

#include "robots/robot.h"

namespace walker {

/// A robot without observations, sensors or saved states. Derived classes fill the specification.
class BareRobot : public Robot {
 public:
  const Specification& specification() const override { return specification_; }
  void observe(double* /*observation*/) const override {}
  void sense(Sensors& /*sensors*/) override {}
  void scene(Scene& /*scene*/) const override {}
  void save(StateWriter& /*writer*/) const override { throw std::logic_error("save"); }
  std::function<void()> load(StateReader& /*reader*/) override { throw std::logic_error("load"); }

 protected:
  Specification specification_;
};

}  // namespace walker
