#include "episode/walker.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <stdexcept>
#include <utility>

#include "base/bits.h"
#include "base/checks.h"
#include "base/engine_release.h"
#include "base/limits.h"
#include "base/printable_text.h"
#include "base/random.h"
#include "base/shortest_text.h"

namespace walker {
namespace {

/// Truncates strings of untrusted records, to bound the length of messages.
std::string shortened(const std::string& text) {
  return text.size() <= kMaxQuotedBytes ? text : text.substr(0, kMaxQuotedBytes) + "...";
}

void compare(const std::string& field, const std::string& recorded, const std::string& own) {
  if (recorded == own) return;
  throw std::invalid_argument(shortened(field) + " = " + shortened(recorded) +
                              " in the record; here it is " + own);
}

void compare_parameters(const EpisodeRecord& record, const EpisodeRecord& own) {
  std::map<std::string, std::string> recorded;
  for (const auto& [name, value] : record.parameters) {
    if (recorded.emplace(name, value).second) continue;
    throw std::invalid_argument("parameter " + shortened(name) + " is given twice in the record");
  }
  const std::string absent = "(absent)";
  for (const auto& [name, value] : own.parameters) {
    const auto found = recorded.find(name);
    compare("parameter " + name, found == recorded.end() ? absent : found->second, value);
    recorded.erase(name);
  }
  for (const auto& [name, value] : recorded) compare("parameter " + name, value, absent);
}

bool names_a_level(const World& world) {
  return std::any_of(world.begin(), world.end(), [](const auto& name_value) {
    const std::string& name = name_value.first;
    const std::string kind = name.substr(0, name.find('_'));
    return kind == "ground" || kind == "obstacle" || kind == "pit" || kind == "stump" ||
           kind == "stair";
  });
}

/// Checks that each step and link has at most one push, in their order.
void check_pushes(const EpisodeRecord& record, const Specification& specification) {
  std::pair<std::uint32_t, std::uint32_t> last{0, 0};  // no push is in step 0
  for (std::size_t i = 0; i < record.pushes.size(); ++i) {
    const RecordedPush& push = record.pushes[i];
    const std::string name = "pushes[" + std::to_string(i) + "]";
    if (push.step < 1 || push.step > record.num_steps) {
      throw std::invalid_argument(name + ".step = " + std::to_string(push.step) +
                                  "; must be in [1, " + std::to_string(record.num_steps) + "]");
    }
    try {
      check_wrench(push.wrench, specification);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(name + "." + error.what());
    }
    const std::pair<std::uint32_t, std::uint32_t> place{push.step, push.wrench.link};
    if (i > 0 && place <= last) {
      throw std::invalid_argument(
          name + " is not after the push before it, in the order of step and link");
    }
    last = place;
  }
}

void check_recorded_coordinates(const EpisodeRecord& record, const Specification& specification) {
  for (std::size_t i = 0; i < record.coordinates.size(); ++i) {
    const auto& [step, position, velocity] = record.coordinates[i];
    const std::string name = "coordinates[" + std::to_string(i) + "]";
    const std::uint32_t lowest = i == 0 ? 0 : record.coordinates[i - 1].step;
    if (step < lowest || step > record.num_steps) {
      throw std::invalid_argument(name + ".step = " + std::to_string(step) + "; must be in [" +
                                  std::to_string(lowest) + ", " + std::to_string(record.num_steps) +
                                  "]");
    }
    try {
      check_coordinates(specification, position, velocity);
    } catch (const std::logic_error& error) {
      throw std::invalid_argument(name + ": " + error.what());
    }
  }
}

void check_count(std::size_t count, std::size_t most, const char* what) {
  if (count <= most) return;
  throw std::invalid_argument("the record has " + std::to_string(count) + " " + what +
                              "; must have at most " + std::to_string(most));
}

}  // namespace

void check_wrench(const LinkWrench& wrench, const Specification& specification) {
  const std::size_t num_links = specification.links.size();
  if (wrench.link >= num_links) {
    throw std::invalid_argument("link = " + std::to_string(wrench.link) + "; must be below " +
                                std::to_string(num_links));
  }
  const auto check = [](const char* name, double value, const char* unit) {
    if (std::abs(value) <= kMaxTurnedPush) return;
    throw std::invalid_argument(std::string(name) + " = " + shortest_text(value) + unit +
                                "; must be in [-" + shortest_text(kMaxTurnedPush) + ", " +
                                shortest_text(kMaxTurnedPush) + "]");
  };
  check("force_x", wrench.force_x, " N");
  check("force_z", wrench.force_z, " N");
  check("torque_y", wrench.torque_y, " N m");
}

EpisodeRecord describe_origin(const Specification& specification) {
  EpisodeRecord record;
  record.id = specification.id;
  for (const auto& [name, value] : specification.parameters) {
    record.parameters.emplace_back(name, to_string(value));
  }
  record.engine = specification.engine;
  record.engine_version = specification.engine_version;
  return record;
}

void check_repeatable(const EpisodeRecord& record, const Specification& specification) {
  const EpisodeRecord own = describe_origin(specification);
  compare("id", record.id, own.id);
  compare_parameters(record, own);
  compare("engine", record.engine, own.engine);
  compare("engine_version", engine_release(record.engine_version),
          engine_release(own.engine_version));
  // With another libm variant the results may differ in the last bits.
  const std::string libm = variant_of(record.engine_version, kLibm);
  const std::string own_libm = variant_of(own.engine_version, kLibm);
  if (!libm.empty() && !own_libm.empty()) compare("libm", libm, own_libm);
  if (names_a_level(record.world)) {
    compare("levels", variant_of(record.engine_version, kLevels, "boxes"),
            variant_of(own.engine_version, kLevels, "boxes"));
  }
  if (!specification.episodes_are_independent) {
    throw std::invalid_argument(
        "reuse_world = true: an episode depends on those before it, which a record does not have");
  }
  check_drawn_world(specification, record.world);
  if (record.seed && Generator(*record.seed).state() != record.generator_state) {
    throw std::invalid_argument("generator_state is not that of seed = " +
                                std::to_string(*record.seed));
  }
  const std::size_t expected = std::size_t{record.num_steps} * specification.action_size();
  if (record.actions.size() != expected) {
    throw std::invalid_argument("actions has " + std::to_string(record.actions.size()) +
                                " values; must have " + std::to_string(expected) + ", " +
                                std::to_string(record.num_steps) + " steps of " +
                                std::to_string(specification.action_size()));
  }
  check_pushes(record, specification);
  check_recorded_coordinates(record, specification);
  const std::size_t num_transitions = std::size_t{record.num_steps} + 1;
  if (!record.checksums.empty() && record.checksums.size() != num_transitions) {
    throw std::invalid_argument("checksums has " + std::to_string(record.checksums.size()) +
                                " values; must have none or " + std::to_string(num_transitions));
  }
}

EpisodeRecord Walker::record() const {
  if (!state_.has_begun()) throw std::logic_error("there is no episode yet; reset first");
  if (state_.failed_at_reset()) {
    throw std::logic_error(std::string("there is no episode: ") + kResetFailed + "; reset first");
  }
  if (was_loaded_) {
    throw std::logic_error(
        "the episode continues from a saved state, and the steps before it are not known");
  }
  if (state_.step > kMaxRecordedSteps) {
    throw std::logic_error("the episode has " + std::to_string(state_.step) +
                           " steps; a record can have at most " +
                           std::to_string(kMaxRecordedSteps));
  }
  EpisodeRecord record = describe_origin(specification());
  record.seed = state_.seed;
  record.generator_state = state_.generator_state;
  record.world = drawn_world();
  record.num_steps = state_.step;
  record.actions = actions_;
  record.pushes = pushes_;
  record.coordinates = coordinates_;
  record.checksums = checksums_;
  check_repeatable(record, specification());
  return record;
}

void Walker::begin(const EpisodeRecord& record) {
  check_repeatable(record, specification());
  check_count(record.num_steps, kMaxRecordedSteps, "steps");
  check_count(record.pushes.size(), kMaxRecordedPushes, "pushes");
  check_count(record.coordinates.size(), kMaxRecordedCoordinates, "coordinates");
  set_generator_state(record.generator_state);  // may throw, before anything has changed
  begin_episode(record.seed, std::make_shared<const World>(record.world));
  if (state_.failed_at_reset()) {
    throw std::invalid_argument("the reset of the record: " + state_.error);
  }
}

bool Walker::repeat(const EpisodeRecord& record, std::chrono::steady_clock::time_point until) {
  const std::size_t size = specification().action_size();
  for (bool is_late = false;; is_late = std::chrono::steady_clock::now() >= until) {
    const RecordedCoordinates* const set = next_coordinates(record);
    if (set == nullptr) {
      require_checksum(record);  // of this step, and of all coordinates that were set after it
      if (state_.step == record.num_steps) return true;
    }
    if (is_late) return false;
    const std::uint32_t step_number = state_.step + (set == nullptr ? 1 : 0);
    try {
      if (set != nullptr) {
        set_coordinates(set->position, set->velocity);
      } else {
        repeat_pushes(record);
        step(&record.actions[state_.step * size], size);
      }
    } catch (const std::exception& error) {
      throw std::invalid_argument("step " + std::to_string(step_number) +
                                  " of the record: " + error.what());
    }
  }
}

/// Returns the coordinates that the record sets next after the present step; null: none. Those that
/// have been set are in `coordinates_`.
const RecordedCoordinates* Walker::next_coordinates(const EpisodeRecord& record) const {
  if (coordinates_.size() >= record.coordinates.size()) return nullptr;
  const RecordedCoordinates& next = record.coordinates[coordinates_.size()];
  return next.step == state_.step ? &next : nullptr;
}

/// Pushes as in the record's next step, also with zeros, which earlier versions recorded. Those of
/// earlier steps are in `pushes_`.
void Walker::repeat_pushes(const EpisodeRecord& record) {
  for (std::size_t i = pushes_.size(); i < record.pushes.size(); ++i) {
    if (record.pushes[i].step != state_.step + 1) return;
    check_wrench(record.pushes[i].wrench, specification());
    add_wrench(record.pushes[i].wrench);
  }
}

void Walker::require_checksum(const EpisodeRecord& record) const {
  if (record.checksums.empty()) return;
  const std::uint64_t recorded = record.checksums[state_.step];
  if (recorded == checksums_.back()) return;
  throw std::invalid_argument("step " + std::to_string(state_.step) +
                              " of the record: checksum = " + std::to_string(recorded) +
                              "; repeated here it is " + std::to_string(checksums_.back()));
}

/// Appends the checksum of a step, or continues it after coordinates were set.
/// FNV-1a on 64-bit words; the shift lets a difference in a sign reach the lower bits.
void Walker::record_checksum() {
  constexpr std::uint64_t kOffsetBasis = 0xcbf29ce484222325;
  constexpr std::uint64_t kPrime = 0x100000001b3;
  std::uint64_t checksum = checksums_.empty() ? kOffsetBasis : checksums_.back();
  const auto add = [&checksum](std::uint64_t word) {
    checksum = (checksum ^ word) * kPrime;
    checksum ^= checksum >> 32U;
  };
  add(state_.step);
  for (const double value : state_.observation) add(to_bits(value));
  add(to_bits(state_.reward));
  add(state_.terminated ? 1 : 0);
  add(state_.truncated ? 1 : 0);
  for (const double value : state_.info) add(to_bits(value));
  checksums_.resize(state_.step + std::size_t{1});
  checksums_.back() = checksum;
}

}  // namespace walker
