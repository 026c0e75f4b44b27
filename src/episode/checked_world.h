// What an episode draws from its world, at its reset and later.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/random.h"
#include "base/state_bytes.h"
#include "walker_sim/export.h"
#include "walker_sim/specification.h"
#include "walker_sim/world.h"

namespace walker {

/// A world that an environment can apply.
class WALKER_SIM_EXPORT CheckedWorld {
 public:
  /// @throws std::invalid_argument as `check_world`, for what the environment cannot apply, or for
  /// a
  ///         delay or an interval that is rounded to no step
  CheckedWorld(const Specification& specification, World world);

  /// Returns a checked world to share; null for the empty one. @throws as the constructor
  static std::shared_ptr<const CheckedWorld> share(const Specification& specification,
                                                   const World& world);

  const World& ranges() const { return ranges_; }

  /// Draws the numbers of an episode. The ranges of what changes within it stay. Each parameter has
  /// a generator of its own, `derive(episode, name)`, so that a value depends neither on the others
  /// nor on the episode's generator. Numbers draw nothing. Delays are rounded to whole steps.
  /// @param episode state of the episode's generator before the reset
  World draw(const GeneratorState& episode) const;

 private:
  World ranges_;
  std::vector<std::string> whole_;     // names of whole numbers
  std::vector<std::string> changing_;  // names of those that change within an episode
  double dt_;
};

/// Checks what a record or a saved state names as drawn. An interval may have been drawn that is
/// rounded to no step, and then acted as one.
/// @throws std::invalid_argument as `check_world`, for what the environment cannot apply, or naming
/// a
///         range that is not of physics, or that has no `change_interval` beside it
void check_drawn_world(const Specification& specification, const World& drawn);

/// The values that act in an episode. What its world has as ranges changes within it: before step
/// 1 + k n, with n steps of `change_interval` and k = 1, 2 ..., each of these takes the next draw
/// from its generator `derive(episode, name)`, whose first one acts from the reset on.
class EpisodeValues {
 public:
  /// @param drawn of `CheckedWorld::draw`
  /// @param dt duration of a step [s]
  EpisodeValues(const World& drawn, double dt, const GeneratorState& episode);

  const WorldValues& present() const { return present_; }

  /// Prepares a step, and returns whether values have changed. Successive calls pass successive
  /// steps.
  /// @param step to make, from 1
  bool begin_step(std::uint32_t step);

  void save(StateWriter& writer) const;
  /// @throws std::invalid_argument if the state is damaged
  void load(StateReader& reader);

 private:
  struct Changing {
    std::string name;
    WorldRange range;
    Generator generator;
  };

  void draw();

  WorldValues present_;
  std::vector<Changing> changing_;
  std::uint32_t period_ = 0;  // steps
};

/// Returns the number of whole steps, halves up.
std::uint32_t to_steps(double seconds, double dt);

}  // namespace walker
