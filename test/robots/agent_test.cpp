// make_agent: the random agent, and the error for an unknown name.
#include "walker_sim/agent.h"

#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <vector>

#include "error_message.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

TEST(Agent, ARandomOneGivesSinglePrecisionWithinTheBoundsAndIsRepeatedByItsSeed) {
  const std::unique_ptr<Environment> environment = make("Walker2d-v5");
  const Specification& specification = environment->specification();
  const auto one = make_agent("random", specification, 5);
  const auto same = make_agent("random", specification, 5);
  const auto other = make_agent("random", specification, 6);
  const std::vector<double> observation(specification.observation_size());
  one->reset();
  for (int i = 0; i < 100; ++i) {
    const std::vector<double> action = one->act(observation);
    EXPECT_EQ(action, same->act(observation));
    EXPECT_NE(action, other->act(observation));
    ASSERT_EQ(action.size(), specification.action_size());
    for (std::size_t k = 0; k < action.size(); ++k) {
      EXPECT_GE(action[k], specification.action_low[k]);
      EXPECT_LE(action[k], specification.action_high[k]);
      EXPECT_EQ(action[k], double{static_cast<float>(action[k])});
    }
  }
}

TEST(Agent, AnUnknownOneIsNamed) {
  const std::unique_ptr<Environment> environment = make("Walker2d-v5");
  EXPECT_EQ(message_of<std::invalid_argument>(
                [&] { make_agent("clever", environment->specification(), 0); }),
            "agent = clever: must be heuristic or random");
}

}  // namespace
}  // namespace walker
