// Steps environments for a test that talks through a pipe, so that it compares thousands of steps
// with Gymnasium without a binding.
//
// A command is one line on stdin, where needed followed by raw doubles. The answer is a line
// `ok BYTES` followed by that many bytes, or a line `error MESSAGE`. Numbers are native 64 bits.
//
//   make ID [NAME=true|false|INTEGER ...]  -> nothing; the environment of the commands below
//   reset SEED|-           -> observation; - continues the generator
//   step N + N x action    -> rows of observation, reward, terminated, truncated; ends with the
//                             episode, however many actions are left
//   state                  -> generator state, 6 integers
//   spaces                 -> observation low, high, action low, high, dt, max_episode_steps,
//                             reward_threshold
//   act N + N x 24         -> N x 4 actions of a new heuristic that sees these observations
//   terrain 0|1 SEED       -> 200 ground points, number of obstacles, 4 points of each, 10 clouds
//                             of 5 points, push; 1: hardcore
//   random SEED DRAW ...   -> one number a draw, then generator state, 6 integers. A draw is
//                             `random`, `uniform LOW HIGH` or `integers LOW HIGH`
#include <array>
#include <cstdint>
#include <cstring>
#include <exception>
#include <iostream>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "bipedal_walker/bipedal_walker.h"
#include "bipedal_walker/heuristic.h"
#include "bipedal_walker/terrain_numbers.h"
#include "core/random.h"
#include "walker_sim/registry.h"

namespace {

using walker::bipedal_walker::kJointCount;
using walker::bipedal_walker::kObservationSize;

/// Numbers of an answer.
class Answer {
 public:
  void add(double value) { add_bytes(value); }
  template <typename Range>
  void add_all(const Range& range) {
    for (const auto& element : range) add(element);
  }
  void add(const walker::GeneratorState& state) {
    for (const std::uint64_t word : state) add_bytes(word);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  template <typename T>
  void add_bytes(const T& value) {
    std::array<char, sizeof(T)> raw{};
    std::memcpy(raw.data(), &value, sizeof(T));
    bytes_.append(raw.data(), raw.size());
  }

  std::string bytes_;
};

std::vector<double> read_numbers(std::size_t count) {
  std::vector<double> numbers(count);
  std::string raw(count * sizeof(double), '\0');
  std::cin.read(raw.data(), static_cast<std::streamsize>(raw.size()));
  if (!std::cin) throw std::runtime_error("the input ended within the numbers of a command");
  std::memcpy(numbers.data(), raw.data(), raw.size());
  return numbers;
}

walker::Parameters read_parameters(std::istream& words) {
  walker::Parameters parameters;
  for (std::string word; words >> word;) {
    const std::size_t equals = word.find('=');
    if (equals == std::string::npos) throw std::invalid_argument(word + ": must be NAME=VALUE");
    const std::string value = word.substr(equals + 1);
    if (value == "true" || value == "false") {
      parameters[word.substr(0, equals)] = value == "true";
    } else {
      parameters[word.substr(0, equals)] = std::int64_t{std::stoll(value)};
    }
  }
  return parameters;
}

template <typename T>
T read(std::istream& words) {
  T value;
  if (!(words >> value)) throw std::invalid_argument("a word of the command is missing or wrong");
  return value;
}

class Session {
 public:
  Answer obey(const std::string& line) {
    std::istringstream words(line);
    const auto command = read<std::string>(words);
    if (command == "make") return make(words);
    if (command == "reset") return reset(read<std::string>(words));
    if (command == "step") return step(read<std::size_t>(words));
    if (command == "state") return state();
    if (command == "spaces") return spaces();
    if (command == "act") return act(read<std::size_t>(words));
    if (command == "terrain") return terrain(words);
    if (command == "random") return random(words);
    throw std::invalid_argument("command " + command + ": unknown");
  }

 private:
  Answer make(std::istream& words) {
    const auto id = read<std::string>(words);
    environment_ = walker::make(id, read_parameters(words));
    observation_.assign(environment_->specification().observation_size(), 0);
    info_.assign(environment_->specification().info_names.size(), 0);
    result_.observation = observation_.data();
    result_.info = info_.data();
    return {};
  }

  Answer reset(const std::string& seed) {
    if (seed == "-") {
      environment().reset(std::nullopt, result_);
    } else {
      environment().reset(std::stoull(seed), result_);
    }
    Answer answer;
    answer.add_all(observation_);
    return answer;
  }

  Answer step(std::size_t count) {
    const std::size_t size = environment().specification().action_size();
    const std::vector<double> actions = read_numbers(count * size);
    Answer answer;
    for (std::size_t i = 0; i < count; ++i) {
      environment().step(&actions[i * size], size, result_);
      answer.add_all(observation_);
      answer.add(result_.reward);
      answer.add(result_.terminated ? 1 : 0);
      answer.add(result_.truncated ? 1 : 0);
      if (result_.terminated || result_.truncated) break;
    }
    return answer;
  }

  Answer state() {
    Answer answer;
    answer.add(environment().generator_state());
    return answer;
  }

  Answer spaces() {
    const walker::Specification& specification = environment().specification();
    Answer answer;
    answer.add_all(specification.observation_low);
    answer.add_all(specification.observation_high);
    answer.add_all(specification.action_low);
    answer.add_all(specification.action_high);
    answer.add(specification.dt);
    answer.add(specification.max_episode_steps);
    answer.add(specification.reward_threshold);
    return answer;
  }

  static Answer act(std::size_t count) {
    const std::vector<double> observations = read_numbers(count * kObservationSize);
    walker::bipedal_walker::Heuristic heuristic;
    std::array<double, kJointCount> action{};
    Answer answer;
    for (std::size_t i = 0; i < count; ++i) {
      heuristic.act(&observations[i * kObservationSize], action.data());
      answer.add_all(action);
    }
    return answer;
  }

  static Answer terrain(std::istream& words) {
    const bool hardcore = read<bool>(words);
    Answer answer;
    answer.add_all(walker::bipedal_walker::terrain_numbers(hardcore, read<std::uint64_t>(words)));
    return answer;
  }

  static Answer random(std::istream& words) {
    walker::Generator generator(read<std::uint64_t>(words));
    Answer answer;
    for (std::string draw; words >> draw;) {
      if (draw == "random") {
        answer.add(generator.random());
      } else if (draw == "uniform") {
        const auto low = read<double>(words);
        answer.add(generator.uniform(low, read<double>(words)));
      } else if (draw == "integers") {
        const auto low = read<std::int64_t>(words);
        answer.add(static_cast<double>(generator.integers(low, read<std::int64_t>(words))));
      } else {
        throw std::invalid_argument("draw " + draw + ": unknown");
      }
    }
    answer.add(generator.state());
    return answer;
  }

  walker::Environment& environment() {
    if (!environment_) throw std::logic_error("no environment yet; make one first");
    return *environment_;
  }

  std::unique_ptr<walker::Environment> environment_;
  std::vector<double> observation_;
  std::vector<double> info_;
  walker::Result result_;
};

}  // namespace

int main() {
  std::ios::sync_with_stdio(false);
  Session session;
  for (std::string line; std::getline(std::cin, line);) {
    try {
      const Answer answer = session.obey(line);
      std::cout << "ok " << answer.bytes().size() << '\n' << answer.bytes() << std::flush;
    } catch (const std::exception& exception) {
      std::cout << "error " << exception.what() << '\n' << std::flush;
    }
  }
  return 0;
}
