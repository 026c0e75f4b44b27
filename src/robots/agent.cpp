#include "walker_sim/agent.h"

#include <stdexcept>

#include "base/random.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

class RandomAgent : public Agent {
 public:
  RandomAgent(const Specification& specification, std::uint64_t seed)
      : low_(specification.action_low),
        high_(specification.action_high),
        generator_(seed),
        action_(low_.size()) {}

  void reset() override {}

  const std::vector<double>& act(const std::vector<double>& /*observation*/) override {
    for (std::size_t i = 0; i < action_.size(); ++i) {
      const double drawn = generator_.uniform(low_[i], high_[i]);
      action_[i] = double{static_cast<float>(drawn)};
    }
    return action_;
  }

 private:
  std::vector<double> low_;
  std::vector<double> high_;
  Generator generator_;
  std::vector<double> action_;
};

}  // namespace

std::unique_ptr<Agent> make_agent(const std::string& name, const Specification& specification,
                                  std::uint64_t seed) {
  if (name == "random") return std::make_unique<RandomAgent>(specification, seed);
  if (name != "heuristic") {
    throw std::invalid_argument("agent = " + name + ": must be heuristic or random");
  }
  const Registration& registration = find_registration(specification.id);
  if (!registration.create_gait) {
    throw std::invalid_argument("agent = heuristic: there is none for " + specification.id);
  }
  return registration.create_gait(specification);
}

}  // namespace walker
