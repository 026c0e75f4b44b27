// Scripts of calls to walkers, and the trace of what came back: the same behind every interface.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "bits.h"
#include "robots/mujoco/model_file.h"
#include "walker_sim/parameters.h"
#include "walker_sim/registry.h"
#include "walker_sim/world.h"

namespace walker::promises {

constexpr std::uint32_t kNumWalkers = 3;

using Seed = std::optional<std::uint64_t>;
using Rows = std::vector<std::uint32_t>;

/// The lines of each walker: one for each reset and each step, with all bits that came back.
using Trace = std::vector<std::vector<std::string>>;

struct Case {
  std::string name;
  std::string id;
  Parameters parameters;
  std::string model;  // OLD->NEW in the id's MJCF; empty: no change
  std::string level;
};

struct Call {
  std::string name;
  Rows walkers;
  std::string argument;
};

struct Script {
  std::string name;
  std::vector<Call> calls;
};

/// Contents of scripts.txt.
struct Scripts {
  std::vector<Case> cases;
  std::vector<Script> scripts;
};

inline World to_world(const std::string& text) {
  return text[0] == '{' ? parse_world(text, "scripts.txt") : load_world(text);
}

inline Rows to_rows(const std::string& text) {
  if (text == "*") return {0, 1, 2};
  Rows rows;
  std::istringstream words(text);
  for (std::string word; std::getline(words, word, ',');) {
    rows.push_back(static_cast<std::uint32_t>(std::stoul(word)));
  }
  return rows;
}

/// Returns the parameters of a case, whose changed model is written once.
inline Parameters parameters_of(const Case& one) {
  if (one.model.empty()) return one.parameters;
  static const Folder kFolder;
  const std::size_t arrow = one.model.find("->");
  Parameters parameters = one.parameters;
  parameters["xml_file"] = kFolder.write(
      "changed.xml", mujoco::replaced(mujoco::builtin_text("walker2d_v5.xml"),
                                      one.model.substr(0, arrow), one.model.substr(arrow + 2)));
  return parameters;
}

inline Case to_case(std::istringstream& words) {
  Case one;
  words >> one.name >> one.id;
  for (std::string word; words >> word && word != "|";) {
    const std::string name = word.substr(0, word.find('='));
    const std::string value = word.substr(name.size() + 1);
    if (name == "model") {
      one.model = value;
    } else if (value == "true" || value == "false") {
      one.parameters[name] = value == "true";
    } else {
      one.parameters[name] = std::stod(value);
    }
  }
  std::getline(words >> std::ws, one.level);
  return one;
}

inline Scripts read_scripts() {
  Scripts all;
  std::ifstream file(WALKER_SIM_SOURCE_DIR "/test/promises/scripts.txt");
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    Call call;
    std::string second;
    words >> call.name;
    if (call.name == "case") {
      all.cases.push_back(to_case(words));
      continue;
    }
    words >> second;
    if (call.name == "script") {
      all.scripts.push_back({second, {}});
      continue;
    }
    if (call.name == "step") {
      call.argument = second;
    } else {
      call.walkers = to_rows(second);
      std::getline(words >> std::ws, call.argument);
    }
    all.scripts.back().calls.push_back(call);
  }
  return all;
}

/// An action's value in [-1.25, 1.25), exact in single precision, by SplitMix64.
inline double action_value(std::uint64_t step, std::uint64_t walker, std::uint64_t joint) {
  std::uint64_t bits = ((step << 16U) + (walker << 8U) + joint + 1) * 0x9E3779B97F4A7C15U;
  bits = (bits ^ (bits >> 30U)) * 0xBF58476D1CE4E5B9U;
  bits = (bits ^ (bits >> 27U)) * 0x94D049BB133111EBU;
  bits ^= bits >> 31U;
  return (static_cast<double>(bits >> 44U) - 524288) * 5 / 2097152;
}

inline std::string hexadecimal(double value) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(to_bits(value)));
  return text;
}

/// Returns NAME=BITS for each value that is not NaN.
inline std::string to_text(const std::vector<std::string>& names, const double* values) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (values[i] == values[i]) text += " " + names[i] + "=" + hexadecimal(values[i]);
  }
  return text;
}

/// Returns NAME=BITS for each number and NAME=BITS:BITS for each range.
inline std::string to_text(const World& world) {
  std::string text;
  for (const auto& [name, range] : world) {
    text += " world " + name + "=" + hexadecimal(range.low);
    if (!range.is_number()) text += ":" + hexadecimal(range.high);
  }
  return text;
}

/// Walkers behind an interface. Each call appends to the trace.
class Interface {
 public:
  /// @param count of walkers: those from kNumWalkers on do what walker i % kNumWalkers does
  explicit Interface(Specification specification, std::uint32_t count = kNumWalkers)
      : trace(count), drawn(count), specification_(std::move(specification)) {}
  Interface(const Interface&) = delete;
  Interface& operator=(const Interface&) = delete;
  virtual ~Interface() = default;

  const Specification& specification() const { return specification_; }

  /// @param seed of walker 0; nullopt: the generators continue
  virtual void reset(const Rows& walkers, Seed seed) = 0;
  /// Steps each walker, or resets it if the interface does so in a step.
  virtual void step(const std::vector<double>& actions) = 0;
  virtual void set_world(std::uint32_t walker, const World& world) = 0;
  virtual void set_coordinates(std::uint32_t walker, const std::vector<double>& position,
                               const std::vector<double>& velocity) = 0;
  virtual std::vector<std::byte> save(std::uint32_t walker) = 0;
  virtual void load(std::uint32_t walker, const std::vector<std::byte>& state) = 0;

  /// Makes a call that must throw.
  virtual void refuse(std::uint32_t walker, const std::string& what) {
    SCOPED_TRACE("refuse " + std::to_string(walker) + " " + what);
    if (what == "action") {
      std::vector<double> actions(kNumWalkers * specification_.action_size());
      actions[walker * specification_.action_size()] = std::nan("");
      EXPECT_ANY_THROW(refuse_step(walker, actions));
    } else if (what == "size") {
      EXPECT_ANY_THROW(refuse_step(walker, {}));
    } else if (what == "world") {
      EXPECT_ANY_THROW(set_world(walker, {{"wind", {1, 1}}}));
    } else if (what == "state") {
      std::vector<std::byte> state = save(walker);
      state.back() ^= std::byte{1};
      EXPECT_ANY_THROW(load(walker, state));
    } else {
      FAIL() << "unknown";
    }
  }

  Trace trace;
  std::vector<World> drawn;  // by the present episodes

 protected:
  /// Appends a reset's line.
  /// @param error the engine's message; empty: it has succeeded
  void add_reset(std::uint32_t walker, const double* observation, const double* info,
                 const World& world, const std::string& error) {
    drawn[walker] = world;
    if (!error.empty()) {
      trace[walker].push_back("reset failed: " + error);
      return;
    }
    std::string line =
        "reset" + observation_text(observation) + to_text(specification_.info_names, info);
    trace[walker].push_back(line + to_text(world));
  }

  void add_step(std::uint32_t walker, const double* observation, double reward, bool terminated,
                bool truncated, const double* info, const std::string& error) {
    std::string line = "step" + observation_text(observation) + " reward=" + hexadecimal(reward);
    if (terminated) line += " terminated";
    if (truncated) line += " truncated";
    line += to_text(specification_.info_names, info);
    if (!error.empty()) line += " failed: " + error;
    trace[walker].push_back(line);
  }

  /// Makes a step that must throw because of this walker's action.
  virtual void refuse_step(std::uint32_t /*walker*/, const std::vector<double>& actions) {
    step(actions);
  }

 private:
  std::string observation_text(const double* observation) const {
    std::string text;
    for (std::size_t i = 0; i < specification_.observation_size(); ++i) {
      text += " " + hexadecimal(observation[i]);
    }
    return text;
  }

  const Specification specification_;
};

/// Walkers that are called one by one. The caller resets them when an episode has ended: at once,
/// or in place of the next step.
class SingleWalkers : public Interface {
 public:
  SingleWalkers(const Specification& specification, bool resets_at_once)
      : Interface(specification), resets_at_once_(resets_at_once) {}

  void reset(const Rows& walkers, Seed seed) override {
    for (const std::uint32_t walker : walkers) {
      reset_one(walker, seed ? Seed(*seed + walker) : std::nullopt);
    }
  }

  void step(const std::vector<double>& actions) override {
    const std::size_t size = specification().action_size();
    for (std::uint32_t walker = 0; walker < kNumWalkers; ++walker) {
      if (has_ended(walker)) {
        reset_one(walker, std::nullopt);
        continue;
      }
      step_one(walker, &actions[walker * size], size);
      if (resets_at_once_ && has_ended(walker)) reset_one(walker, std::nullopt);
    }
  }

 protected:
  virtual void reset_one(std::uint32_t walker, Seed seed) = 0;
  virtual void step_one(std::uint32_t walker, const double* action, std::size_t size) = 0;
  /// Whether the episode has ended, also by a reset that failed.
  virtual bool has_ended(std::uint32_t walker) const = 0;

  void refuse_step(std::uint32_t walker, const std::vector<double>& actions) override {
    const std::size_t size = actions.size() / kNumWalkers;
    step_one(walker, actions.data() + walker * size, size);
  }

 private:
  const bool resets_at_once_;
};

inline std::vector<double> actions_of(const Interface& interface, std::uint64_t step) {
  const std::size_t size = interface.specification().action_size();
  std::vector<double> actions;
  for (std::uint32_t walker = 0; walker < kNumWalkers; ++walker) {
    for (std::size_t joint = 0; joint < size; ++joint) {
      actions.push_back(action_value(step, walker, joint));
    }
  }
  return actions;
}

/// Sets a standing robot's state. Refused: by a robot without coordinates, and by a failed walker.
inline void set_coordinates(Interface& interface, std::uint32_t walker, std::uint64_t step) {
  std::vector<double> position;
  std::vector<double> velocity;
  for (std::size_t i = 0; i < interface.specification().action_size() + 3; ++i) {
    position.push_back((i == 1 ? 1.25 : 0) + action_value(step, walker, i) / 16);
    velocity.push_back(action_value(step, walker, i + 16) / 4);
  }
  try {
    interface.set_coordinates(walker, position, velocity);
    // NOLINTNEXTLINE(bugprone-empty-catch): if it should not have been refused, later steps differ
  } catch (const std::exception&) {
  }
}

/// Returns the world of a script's text.
inline World world_of(const std::string& text, const Case& one, const Interface& interface) {
  if (text == "level") return to_world(one.level);
  if (text.rfind("drawn ", 0) != 0) return to_world(text);
  return interface.drawn[std::stoul(text.substr(6))];
}

/// Plays a script. @return the trace
inline Trace play(const Script& script, const Case& one, Interface& interface) {
  std::map<std::string, std::vector<std::byte>> states;
  std::uint64_t num_steps = 0;
  for (const auto& [name, walkers, argument] : script.calls) {
    if (name == "reset") {
      interface.reset(walkers, argument.empty() ? Seed() : Seed(std::stoull(argument)));
      continue;
    }
    for (int left = name == "step" ? std::stoi(argument) : 0; left > 0; --left) {
      interface.step(actions_of(interface, ++num_steps));
    }
    for (const std::uint32_t walker : walkers) {
      if (name == "world") {
        interface.set_world(walker, world_of(argument, one, interface));
      } else if (name == "set") {
        set_coordinates(interface, walker, num_steps);
      } else if (name == "save") {
        states[argument] = interface.save(walker);
      } else if (name == "load") {
        interface.load(walker, states.at(argument));
      } else if (name == "refuse") {
        interface.refuse(walker, argument);
      }
    }
  }
  return std::move(interface.trace);
}

}  // namespace walker::promises
