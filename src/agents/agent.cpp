#include "agents/agent.h"

#include <stdexcept>

#include "bipedal_walker/heuristic.h"
#include "core/random.h"

namespace walker {
namespace {

class HeuristicAgent : public Agent {
 public:
  explicit HeuristicAgent(std::size_t action_size) : action_(action_size) {}

  void reset() override { heuristic_ = {}; }

  const std::vector<double>& act(const std::vector<double>& observation) override {
    heuristic_.act(observation.data(), action_.data());
    return action_;
  }

 private:
  bipedal_walker::Heuristic heuristic_;
  std::vector<double> action_;
};

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
  if (name == "heuristic") {
    if (specification.id.rfind("BipedalWalker", 0) == 0) {
      return std::make_unique<HeuristicAgent>(specification.action_size());
    }
    throw std::invalid_argument("agent = heuristic: walks in BipedalWalker only, not in " +
                                specification.id);
  }
  throw std::invalid_argument("agent = " + name + ": must be heuristic or random");
}

}  // namespace walker
