#include "agents/agent.h"

#include <stdexcept>

#include "bipedal_walker/heuristic.h"
#include "core/random.h"
#include "walker2d/heuristic.h"

namespace walker {
namespace {

/// @tparam Heuristic what the environment's folder offers
template <typename Heuristic>
class HeuristicAgent : public Agent {
 public:
  explicit HeuristicAgent(std::size_t action_size) : action_(action_size) {}

  void reset() override { heuristic_ = {}; }

  const std::vector<double>& act(const std::vector<double>& observation) override {
    heuristic_.act(observation.data(), action_.data());
    return action_;
  }

 private:
  Heuristic heuristic_;
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

bool begins_with(const std::string& text, const std::string& beginning) {
  return text.rfind(beginning, 0) == 0;
}

std::unique_ptr<Agent> make_heuristic(const Specification& specification) {
  if (begins_with(specification.id, "BipedalWalker")) {
    return std::make_unique<HeuristicAgent<bipedal_walker::Heuristic>>(specification.action_size());
  }
  if (!begins_with(specification.id, "Walker2d")) {
    throw std::invalid_argument("agent = heuristic: there is none for " + specification.id);
  }
  if (specification.observation_size() != walker2d::Heuristic::kObservationSize) {
    throw std::invalid_argument("agent = heuristic: needs " + specification.id +
                                " with exclude_current_positions_from_observation = true");
  }
  return std::make_unique<HeuristicAgent<walker2d::Heuristic>>(specification.action_size());
}

}  // namespace

std::unique_ptr<Agent> make_agent(const std::string& name, const Specification& specification,
                                  std::uint64_t seed) {
  if (name == "random") return std::make_unique<RandomAgent>(specification, seed);
  if (name == "heuristic") return make_heuristic(specification);
  throw std::invalid_argument("agent = " + name + ": must be heuristic or random");
}

}  // namespace walker
