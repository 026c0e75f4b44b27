// A walker without an engine, whose episodes and failures a test decides on.
#pragma once

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <vector>

#include "bare_environment.h"
#include "episode/episode_rules.h"

namespace walker {

/// Two joints. Its observation is the number of the episode and the steps in it, its reward the sum
/// of the action, its info the seed (-1: none).
class FakeWalker : public BareEnvironment {
 public:
  FakeWalker() {
    specification_.id = "Fake-v0";
    specification_.observation_low = {0, 0};
    specification_.action_low = {-1, -1};
    specification_.joints.resize(2);
    specification_.joints[0].name = "hip";
    specification_.joints[1].name = "knee";
    specification_.info_names = {"seed"};
  }

  void reset(std::optional<std::uint64_t> seed, Result& result) override {
    if (reset_fails) throw std::runtime_error("no ground");
    ++episode;
    steps = 0;
    result.reward = 0;
    result.terminated = false;
    result.truncated = false;
    result.end_reason = "";
    result.error = "";
    show(seed ? static_cast<double>(*seed) : -1, result);
  }
  void step(const double* action, std::size_t /*size*/, Result& result) override {
    if (step_fails) throw std::runtime_error("the engine gave up");
    ++steps;
    ++all_steps;
    result.reward = action[0] + action[1];
    result.terminated = steps == length;
    result.truncated = false;
    result.end_reason = result.terminated ? "fell" : "";
    result.error = "";
    show(-1, result);
  }

  int length = 1000;  ///< of its episodes
  bool reset_fails = false;
  bool step_fails = false;
  int episode = 0;
  int steps = 0;
  int all_steps = 0;

 private:
  void show(double seed, Result& result) const {
    result.observation[0] = episode;
    result.observation[1] = steps;
    result.info[0] = seed;
  }
};

/// Makes walkers for a pool, as the registry does, and keeps hold of them.
template <typename Walker = FakeWalker>
struct Fakes {
  std::unique_ptr<Environment> operator()() {
    auto walker = std::make_unique<Walker>();
    all->push_back(walker.get());
    return std::make_unique<EpisodeRules>(std::move(walker));
  }
  Walker& operator[](std::size_t index) const { return *(*all)[index]; }

  std::shared_ptr<std::vector<Walker*>> all = std::make_shared<std::vector<Walker*>>();
};

}  // namespace walker
