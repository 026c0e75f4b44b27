#include "replay/replay.h"

#include <algorithm>
#include <exception>
#include <iomanip>
#include <optional>
#include <stdexcept>

#include "base/bits.h"
#include "base/engine_release.h"
#include "base/random.h"
#include "base/shortest_text.h"
#include "ros/records.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

std::string text(double value) { return shortest_text(value); }
std::string text(bool value) { return value ? "true" : "false"; }
std::string text(std::size_t value) { return std::to_string(value); }
std::string text(const std::string& value) { return '"' + value + '"'; }

std::string hexadecimal(double value) {
  ClassicStream stream;
  stream << " (0x" << std::hex << std::setw(16) << std::setfill('0') << to_bits(value) << ")";
  return stream.str();
}

/// Compares fields and keeps a description of the first difference.
class Comparison {
 public:
  template <typename Value>
  void compare(const std::string& name, const Value& recorded, const Value& repeated) {
    if (recorded != repeated) differ(name, text(recorded), text(repeated));
  }

  void compare(const std::string& name, double recorded, double repeated) {
    if (to_bits(recorded) == to_bits(repeated)) return;
    std::string one = text(recorded);
    std::string other = text(repeated);
    if (one == other) {  // NaNs of different bits
      one += hexadecimal(recorded);
      other += hexadecimal(repeated);
    }
    differ(name, one, other);
  }

  /// @param element_names printed after the index; may be empty
  void compare(const std::string& name, const std::vector<double>& recorded,
               const std::vector<double>& repeated,
               const std::vector<std::string>& element_names = {}) {
    compare("size of " + name, recorded.size(), repeated.size());
    for (std::size_t i = 0; i < std::min(recorded.size(), repeated.size()); ++i) {
      if (to_bits(recorded[i]) == to_bits(repeated[i])) continue;
      std::string element = name + "[" + std::to_string(i) + "]";
      if (i < element_names.size()) element += " (" + element_names[i] + ")";
      compare(element, recorded[i], repeated[i]);
    }
  }

  const std::string& first() const { return first_; }

 private:
  void differ(const std::string& name, const std::string& recorded, const std::string& repeated) {
    if (first_.empty()) first_ = name + " is " + recorded + ", repeated " + repeated;
  }

  std::string first_;
};

std::string compare_versions(const walker_sim::EnvironmentSpec& recorded,
                             const Specification& own) {
  const std::string then = recorded.engine + " " + engine_release(recorded.engine_version) +
                           " and walker_sim " + recorded.version;
  const std::string now = own.engine + " " + engine_release(own.engine_version) +
                          " and walker_sim " + walker::version();
  std::string differences = then == now ? "" : "recorded with " + then + "; repeated with " + now;
  if (has_other_libm(recorded.engine_version, own.engine_version)) {
    if (!differences.empty()) differences += "; ";
    differences += "recorded with libm: " + libm_of(recorded.engine_version) +
                   "; repeated with libm: " + libm_of(own.engine_version) +
                   ": its sin, cos and pow differ in the last bit, so episodes may differ";
  }
  return differences;
}

}  // namespace

Replay::Replay(const walker_sim::EnvironmentSpec& spec)
    : episode_(make_episode(spec.id, parameters_of(spec))),
      other_versions_(compare_versions(spec, episode_->specification())) {
  if (episode_->specification().episodes_are_independent) return;
  throw std::invalid_argument(
      "its episodes depend on those before them (parameter reuse_world), so none can be repeated "
      "alone");
}

void Replay::begin(const walker_sim::Episode& beginning, const std::vector<double>& actions) {
  difference_.clear();
  is_at_beginning_ = true;
  const std::optional<std::uint64_t> seed = seed_of(beginning);
  const GeneratorState state = generator_state_of(beginning);
  if (seed && Generator(*seed).state() != state) {
    difference_ = "at the beginning: generator_state is not that of seed " + std::to_string(*seed);
    return;
  }
  try {
    episode_->begin(state, seed);
  } catch (const std::exception& error) {
    difference_ = std::string("at the beginning: ") + error.what();
    return;
  }
  const std::size_t size = episode_->specification().action_size();
  for (std::size_t i = 0; i < actions.size() && difference_.empty(); i += size) {
    const auto first = actions.begin() + static_cast<std::ptrdiff_t>(i);
    step({first, first + static_cast<std::ptrdiff_t>(std::min(size, actions.size() - i))});
  }
}

void Replay::step(const std::vector<double>& action) {
  try {
    episode_->step(action);
  } catch (const std::exception& error) {
    // An invalid action, or one after the repeated episode's end.
    difference_ = "at step " + std::to_string(episode_->state().step + 1) +
                  ", which is refused: " + error.what();
  }
}

void Replay::compare(const walker_sim::Transition& recorded) {
  if (!difference_.empty()) return;
  if (!is_at_beginning_) step(recorded.action);
  is_at_beginning_ = false;
  if (!difference_.empty()) return;
  const EpisodeState& repeated = episode_->state();
  Comparison comparison;
  comparison.compare<std::size_t>("step", recorded.step, repeated.step);
  comparison.compare("error", recorded.error, repeated.error);  // first, since it causes the others
  comparison.compare("observation", recorded.observation, repeated.observation);
  comparison.compare("reward", recorded.reward, repeated.reward);
  comparison.compare("episode_return", recorded.episode_return, repeated.episode_return);
  comparison.compare("terminated", recorded.terminated != 0, repeated.terminated);
  comparison.compare("truncated", recorded.truncated != 0, repeated.truncated);
  comparison.compare("info", recorded.info, repeated.info, episode_->specification().info_names);
  if (comparison.first().empty()) return;
  difference_ = "at step " + std::to_string(recorded.step) + ": " + comparison.first();
}

void Replay::compare_end(const walker_sim::Episode& recorded) {
  if (!difference_.empty()) return;
  const EpisodeState& repeated = episode_->state();
  Comparison comparison;
  comparison.compare<std::size_t>("length", recorded.length, repeated.step);
  comparison.compare("episode_return", recorded.episode_return, repeated.episode_return);
  comparison.compare("end_reason", recorded.end_reason, repeated.end_reason);
  if (!comparison.first().empty()) difference_ = "at the end: " + comparison.first();
}

}  // namespace walker
