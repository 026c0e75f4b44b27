// Policy files.
#include "walker_sim/policy.h"

#include <vector>

#include "fuzz/target.h"

namespace walker::fuzz {
namespace {

void run(const std::uint8_t* data, std::size_t size) {
  try {
    Policy policy("file", {data, data + size});
    const std::vector<double> observation(policy.observation_size(), 0.5);
    std::vector<double> action(policy.action_size());
    PolicyInput input(policy);
    policy.act(observation.data(), input, action.data());
  } catch (const PolicyError& refusal) {
    accept(refusal);
  }
}

const Registered kTarget("policy", run);

}  // namespace
}  // namespace walker::fuzz
