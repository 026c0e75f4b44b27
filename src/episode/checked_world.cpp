#include "episode/checked_world.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "base/shortest_text.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

bool has(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Returns the names of what changes within an episode, if its world has a `change_interval`.
std::vector<std::string> changing_names(const std::string& id, const World& world) {
  std::vector<std::string> names;
  if (world.count(kChangeInterval) == 0) return names;
  for (const WorldParameter& parameter : world_parameters(id)) {
    if (parameter.can_change) names.push_back(parameter.name);
  }
  return names;
}

/// Draws from a range that is no number. The number of a logarithmic one stays within its ends,
/// whatever their logarithms are rounded to.
double draw_from(const WorldRange& range, bool is_whole, Generator& generator) {
  if (is_whole) {
    const std::int64_t end = std::llround(range.high) + 1;
    return static_cast<double>(generator.integers(std::llround(range.low), end));
  }
  if (!range.is_log_uniform) return generator.uniform(range.low, range.high);
  const auto [least, most] = std::minmax({std::abs(range.low), std::abs(range.high)});
  const double magnitude = std::exp(generator.uniform(std::log(least), std::log(most)));
  return std::clamp(std::copysign(magnitude, range.low), range.low, range.high);
}

void check_applicable(const Specification& specification, const World& world) {
  check_world(specification.id, world);
  for (const auto& [name, reason] : specification.inapplicable_world_parameters) {
    if (world.count(name) == 0) continue;
    throw std::invalid_argument("world parameter " + name + ": cannot be applied; " + reason);
  }
}

/// Refuses a delay that would always be no step, and an interval that could be.
void check_steps(const Specification& specification, const World& world) {
  for (const char* name : {"action_delay", "observation_delay", "push_interval", kChangeInterval}) {
    const auto found = world.find(name);
    if (found == world.end()) continue;
    const bool is_delay = std::string(name).find("delay") != std::string::npos;
    const double seconds = is_delay ? found->second.high : found->second.low;
    if (seconds == 0 || to_steps(seconds, specification.dt) != 0) continue;
    throw std::invalid_argument("world parameter " + std::string(name) + " = " +
                                shortest_text(seconds) + " s: is shorter than half a step of " +
                                specification.id + " (" + shortest_text(specification.dt / 2) +
                                " s)");
  }
}

}  // namespace

std::uint32_t to_steps(double seconds, double dt) {
  return static_cast<std::uint32_t>(std::lround(seconds / dt));
}

CheckedWorld::CheckedWorld(const Specification& specification, World world)
    : ranges_(std::move(world)), dt_(specification.dt) {
  check_applicable(specification, ranges_);
  check_steps(specification, ranges_);
  for (const WorldParameter& parameter : world_parameters(specification.id)) {
    if (parameter.is_whole) whole_.push_back(parameter.name);
  }
  changing_ = changing_names(specification.id, ranges_);
}

std::shared_ptr<const CheckedWorld> CheckedWorld::share(const Specification& specification,
                                                        const World& world) {
  return world.empty() ? nullptr : std::make_shared<const CheckedWorld>(specification, world);
}

World CheckedWorld::draw(const GeneratorState& episode) const {
  World drawn = ranges_;
  for (auto& [name, range] : drawn) {
    if (range.is_number() || has(changing_, name)) continue;
    Generator generator = derive(episode, name);
    const double value = draw_from(range, has(whole_, name), generator);
    range = {value, value};
  }
  for (const char* name : {"action_delay", "observation_delay"}) {
    const auto found = drawn.find(name);
    if (found == drawn.end()) continue;
    const double delay = dt_ * to_steps(found->second.low, dt_);
    found->second = {delay, delay};
  }
  return drawn;
}

void check_drawn_world(const Specification& specification, const World& drawn) {
  if (drawn.empty()) return;
  check_applicable(specification, drawn);
  const std::vector<std::string> changing = changing_names(specification.id, drawn);
  for (const auto& [name, range] : drawn) {
    if (range.is_number() || has(changing, name)) continue;
    throw std::invalid_argument("world parameter " + to_string(World{{name, range}}) +
                                ": what was drawn must be a number, or a range of physics beside " +
                                kChangeInterval);
  }
}

EpisodeValues::EpisodeValues(const World& drawn, double dt, const GeneratorState& episode) {
  for (const auto& [name, range] : drawn) {
    present_[name] = range.low;
    if (!range.is_number()) changing_.push_back({name, range, derive(episode, name)});
  }
  if (changing_.empty()) return;
  period_ = std::max(1U, to_steps(present_.at(kChangeInterval), dt));
  draw();
}

bool EpisodeValues::begin_step(std::uint32_t step) {
  if (period_ == 0 || step == 1 || (step - 1) % period_ != 0) return false;
  draw();
  return true;
}

void EpisodeValues::save(StateWriter& writer) const {
  for (const Changing& each : changing_) {
    writer.number(present_.at(each.name));
    write_generator(each.generator, writer);
  }
}

void EpisodeValues::load(StateReader& reader) {
  for (auto& [name, range, generator] : changing_) {
    double& value = present_[name] = reader.finite_number<double>("what changes");
    generator = read_generator(reader);
    if (value < range.low || value > range.high) refuse_state(name + " is beyond its range");
  }
}

void EpisodeValues::draw() {
  for (auto& [name, range, generator] : changing_) {
    present_[name] = draw_from(range, false, generator);
  }
}

}  // namespace walker
