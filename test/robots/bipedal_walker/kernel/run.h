// Steps worlds by kernels and by Box2D alone, and compares them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "base/random.h"
#include "robots/bipedal_walker/heuristic.h"
#include "robots/bipedal_walker/observation.h"
#include "robots/bipedal_walker/random_world.h"
#include "robots/bipedal_walker/twin.h"

namespace walker::bipedal_walker {

/// Names of the modes, which define how walkers are driven and when they are reset:
///   random     random actions until the hull touches the ground
///   saturated  actions of -1, 0 and 1
///   heuristic  the heuristic's actions with some noise
///   endless    random actions for 100 to 900 steps, falls included
///   rest       no action for 100 to 900 steps: the walker falls, lies and sleeps
///   thrown     one step in 20, a body gets a random velocity, up to 300 m/s and 300 rad/s
///   far        one step in 20, a body moves by up to 3 m and gets an angle of up to 40 rad
/// Every other one of the random worlds is plain.
inline const std::vector<std::string> kModes{"random", "saturated", "heuristic", "endless",
                                             "rest",   "thrown",    "far"};

struct RunOptions {
  std::string mode = "random";
  bool hardcore = false;
  bool reuse_world = false;
  bool random_worlds = false;
  long steps = 2500;  ///< minimum, summed over the worlds
  std::size_t worlds = 64;
};

struct Tally {
  long different = 0;  ///< states that differ from Box2D's
  std::string first_different;
};

struct Report {
  long steps = 0;  ///< per contestant
  long resets = 0;
  long failures = 0;      ///< assertions that failed in Box2D
  long sleeps = 0;        ///< steps after which a world was asleep
  int most_contacts = 0;  ///< maximum of touching contacts in one world
  std::vector<Tally> tallies;
};

using Action = std::array<double, kJointCount>;
using Random = std::mt19937_64;

inline double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

inline int count_contacts(const Physics& physics) {
  int count = 0;
  for (const b2Contact* contact = physics.world().GetContactList(); contact != nullptr;
       contact = contact->GetNext()) {
    count += contact->IsTouching() ? 1 : 0;
  }
  return count;
}

/// Box2D's copy of a world, and one copy per contestant.
class World {
 public:
  World(std::size_t num_sides, std::uint64_t seed, RunOptions options)
      : options_(std::move(options)), generator_(seed), random_(seed), sides_(num_sides) {
    begin();
  }

  void begin() {
    WorldSettings world;
    if (options_.random_worlds && random_() % 2 != 0)
      world = settings_of(random_values(generator_));
    const Ground terrain = draw_ground(generator_, options_.hardcore, world.level);
    const double push = generator_.uniform(-world.initial_force, world.initial_force);
    for (std::optional<Physics>& side : sides_) {
      if (side && options_.reuse_world && !has_failed_) {
        side->destroy();
      } else {
        side.emplace();
      }
      side->build(terrain, push, world.dynamics);
    }
    has_failed_ = false;
    age_ = 0;
    life_ = random_() % 800;
    heuristic_.reset();
  }

  /// Applies the action to all copies and steps Box2D's.
  void step() {
    const Action action = draw_action();
    ++age_;
    const std::uint64_t seed = random_();
    for (std::optional<Physics>& side : sides_) {
      Random same(seed);
      disturb(*side, same);
      side->drive(action.data());
    }
    try {
      sides_[0]->step();
    } catch (const std::exception&) {
      has_failed_ = true;
    }
  }

  Physics& side(std::size_t index) { return *sides_[index]; }
  bool has_failed() const { return has_failed_; }

  bool has_ended() {
    const Physics& physics = *sides_[0];
    if (has_failed_ || age_ >= 1600) return true;
    if (options_.mode == "endless" || options_.mode == "rest") return age_ > 100 + life_;
    if (options_.mode == "thrown" || options_.mode == "far") return age_ > life_ / 4;
    return physics.hull_has_touched() || physics.hull().GetPosition().x < 0;
  }

 private:
  Action draw_action() {
    Action action{};
    if (options_.mode == "rest") return action;
    if (options_.mode == "heuristic") {
      std::array<double, kObservationSize> observation{};
      write_observation(observed_in(*sides_[0]), observation.data());
      heuristic_.act(observation.data(), action.data());
    }
    for (double& value : action) {
      if (options_.mode == "saturated") {
        value = static_cast<double>(random_() % 3) - 1;
      } else {
        value += (options_.mode == "heuristic" ? 0.2 : 1) * uniform(random_, -1, 1);
      }
    }
    return action;
  }

  void disturb(Physics& physics, Random& random) const {
    const WalkerParts parts = physics.parts();
    if (options_.mode == "thrown" && random() % 20 == 0) {
      b2Body& body = *parts.bodies[random() % parts.bodies.size()];
      const double speed = std::pow(10.0, uniform(random, -1, 2.5));
      body.SetLinearVelocity(b2Vec2(static_cast<float>(speed * uniform(random, -1, 1)),
                                    static_cast<float>(speed * uniform(random, -1, 1))));
      body.SetAngularVelocity(static_cast<float>(speed * uniform(random, -1, 1)));
    }
    if (options_.mode == "far" && random() % 20 == 0) {
      b2Body& body = *parts.bodies[random() % parts.bodies.size()];
      const b2Vec2 position = body.GetPosition();
      const double distance = std::pow(10.0, uniform(random, -2, 0.5));
      body.SetTransform(b2Vec2(position.x + static_cast<float>(distance * uniform(random, -1, 1)),
                               position.y + static_cast<float>(distance * uniform(random, 0, 1))),
                        static_cast<float>(uniform(random, -40, 40)));
    }
  }

  RunOptions options_;
  Generator generator_;
  Random random_;
  std::vector<std::optional<Physics>> sides_;  // the first one is Box2D's
  Heuristic heuristic_;
  bool has_failed_ = false;
  std::uint64_t age_ = 0;
  std::uint64_t life_ = 0;
};

inline std::string describe(World& world, std::size_t side, long steps) {
  const auto ours = world.side(side).parts().bodies;
  const auto theirs = world.side(0).parts().bodies;
  std::ostringstream text;
  text << "after " << steps << " steps, " << count_contacts(world.side(0)) << " contacts:";
  for (std::size_t i = 0; i < ours.size(); ++i) {
    const b2Vec2 apart = ours[i]->GetWorldCenter() - theirs[i]->GetWorldCenter();
    text << "\n  body " << i << " is off by " << apart.x << " " << apart.y;
  }
  return text.str();
}

class Run {
 public:
  Run(const std::vector<const Kernel*>& contestants, const RunOptions& options)
      : contestants_(contestants),
        calls_(options.worlds),
        failures_(options.worlds),
        differs_(options.worlds) {
    report_.tallies.resize(contestants.size());
    worlds_.reserve(options.worlds);
    for (std::size_t i = 0; i < options.worlds; ++i) {
      worlds_.push_back(std::make_unique<World>(contestants.size() + 1, i, options));
    }
  }

  const Report& report() const { return report_; }

  void step() {
    for (const auto& world : worlds_) world->step();
    std::fill(differs_.begin(), differs_.end(), false);
    for (std::size_t k = 0; k < contestants_.size(); ++k) {
      for (std::size_t i = 0; i < worlds_.size(); ++i) {
        failures_[i] = nullptr;
        calls_[i] = {&worlds_[i]->side(k + 1), &failures_[i]};
      }
      step_together(*contestants_[k], calls_.data(), calls_.size());
      compare(k);
    }
    report_.steps += static_cast<long>(worlds_.size());
    for (std::size_t i = 0; i < worlds_.size(); ++i) {
      World& world = *worlds_[i];
      report_.most_contacts = std::max(report_.most_contacts, count_contacts(world.side(0)));
      report_.failures += world.has_failed() ? 1 : 0;
      report_.sleeps += world.side(0).hull().IsAwake() ? 0 : 1;
      if (!differs_[i] && !world.has_ended()) continue;
      ++report_.resets;
      world.begin();
    }
  }

 private:
  bool has_box2ds_bits(std::size_t index, std::size_t side) {
    World& world = *worlds_[index];
    const bool has_failed = failures_[index] != nullptr;
    if (has_failed || world.has_failed()) return has_failed == world.has_failed();
    return words_of(world.side(side)) == words_of(world.side(0));
  }

  void compare(std::size_t contestant) {
    Tally& tally = report_.tallies[contestant];
    const std::size_t side = contestant + 1;
    for (std::size_t i = 0; i < worlds_.size(); ++i) {
      if (has_box2ds_bits(i, side)) continue;
      differs_[i] = true;
      if (tally.different++ == 0) {
        tally.first_different = describe(*worlds_[i], side, report_.steps);
      }
    }
  }

  const std::vector<const Kernel*>& contestants_;
  std::vector<std::unique_ptr<World>> worlds_;
  std::vector<PhysicsCall> calls_;
  std::vector<std::exception_ptr> failures_;
  std::vector<bool> differs_;
  Report report_;
};

/// Steps all worlds by each contestant and by Box2D. A world that differs is reset. If Box2D fails
/// an assertion in a step, all contestants must fail in it.
inline Report run(const std::vector<const Kernel*>& contestants, const RunOptions& options) {
  Run run(contestants, options);
  while (run.report().steps < options.steps) run.step();
  return run.report();
}

}  // namespace walker::bipedal_walker
