// Loads the policy that is shipped for an environment.
#pragma once

#include <memory>

#include <ros/package.h>

#include "walker_sim/policy.h"

namespace walker::test {

inline std::unique_ptr<Agent> make_shipped_policy(const Specification& specification) {
  return make_policy_agent(
      ros::package::getPath("walker_sim") + "/assets/policies/" + specification.id + ".safetensors",
      specification);
}

}  // namespace walker::test
