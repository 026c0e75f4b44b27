// What the environments that tests make up have in common.
#pragma once

#include "walker_sim/environment.h"

namespace walker {

/// Has nothing to be sensed and draws nothing; who derives fills the specification.
class BareEnvironment : public Environment {
 public:
  const Specification& specification() const override { return specification_; }
  void sense(Sensors& /*sensors*/) override {}
  void scene(Scene& /*scene*/) const override {}
  GeneratorState generator_state() const override { return {}; }
  void set_generator_state(const GeneratorState& /*state*/) override {}

 protected:
  Specification specification_;
};

}  // namespace walker
