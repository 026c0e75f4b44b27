// Steps environments for tests that compare them with Gymnasium without the Python binding. A
// command is one line of tab-separated words on stdin; raw doubles follow if the command takes any.
// The answer is a line `ok BYTES` followed by that many bytes, or a line `error MESSAGE`. Numbers
// are 64 bits in native byte order. Commands:
//   make ID [NAME=VALUE ...]
//                          -> nothing; makes the environment for the commands below
//   reset SEED|-           -> a row: observation, reward, terminated, truncated, info (NaN where
//                             absent); - continues the generator
//   step N + N x action    -> rows; stops at the episode's end and ignores the remaining actions
//   render [NAME=VALUE ...]
//                          -> bytes: a picture of the current state, height x width x 3; the words
//                             are camera parameters
//   state                  -> generator state, 6 integers
//   spaces                 -> observation and action size, observation low, high, action low, high,
//                             dt, max_episode_steps, reward_threshold
//   description            -> text: a line with the info names, then a line NAME=VALUE for each
//                             parameter
//   act N + N x 24         -> N x 4 actions of a new BipedalWalker heuristic for N observations
//   terrain 0|1 SEED       -> BipedalWalker's 200 ground points, number of obstacles, 4 points of
//                             each, 10 clouds of 5 points, push; 1: hardcore
//   random SEED DRAW ...   -> one number per draw, then generator state, 6 integers. A draw is
//                             `random`, `uniform LOW HIGH` or `integers LOW HIGH`
#include <array>
#include <cstdint>
#include <exception>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/parameter_text.h"
#include "base/random.h"
#include "robots/bipedal_walker/bipedal_walker.h"
#include "robots/bipedal_walker/heuristic.h"
#include "robots/bipedal_walker/terrain_numbers.h"
#include "stepper.h"

namespace walker {
namespace {

using bipedal_walker::kJointCount;
using bipedal_walker::kObservationSize;

class Answer {
 public:
  void add(double value) { add_bytes(value); }
  template <typename Range>
  void add_all(const Range& range) {
    for (const auto& element : range) add(element);
  }
  void add(const GeneratorState& state) {
    for (const std::uint64_t word : state) add_bytes(word);
  }
  void add(const std::string& text) { bytes_ += text; }
  const std::string& bytes() const { return bytes_; }

 private:
  template <typename T>
  void add_bytes(const T& value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(value));
  }

  std::string bytes_;
};

std::vector<double> read_numbers(std::size_t count) {
  std::vector<double> numbers(count);
  std::cin.read(reinterpret_cast<char*>(numbers.data()),
                static_cast<std::streamsize>(count * sizeof(double)));
  if (!std::cin) throw std::runtime_error("the input ended within the numbers of a command");
  return numbers;
}

template <typename T>
T read(std::istream& words) {
  T value{};
  if (!(words >> value)) throw std::invalid_argument("a word of the command is missing or wrong");
  return value;
}

/// Reads the remaining words, which may contain spaces.
std::vector<std::string> read_rest(std::istream& words) {
  words >> std::ws;
  std::vector<std::string> rest;
  for (std::string word; std::getline(words, word, '\t');) rest.push_back(word);
  return rest;
}

class Session {
 public:
  Answer obey(const std::string& line) {
    std::istringstream words(line);
    const auto command = read<std::string>(words);
    if (command == "make") return make(words);
    if (command == "reset") return reset(read<std::string>(words));
    if (command == "step") return step(read<std::size_t>(words));
    if (command == "render") return render(words);
    if (command == "state") return state();
    if (command == "spaces") return spaces();
    if (command == "description") return description();
    if (command == "act") return act(read<std::size_t>(words));
    if (command == "terrain") return terrain(words);
    if (command == "random") return random(words);
    throw std::invalid_argument("command " + command + ": unknown");
  }

 private:
  Answer make(std::istream& words) {
    const auto id = read<std::string>(words);
    walker_.emplace(id, parse_assignments(parameter_descriptions(id), read_rest(words)));
    renderer_.reset();
    return {};
  }

  Answer reset(const std::string& seed) {
    walker().reset(seed == "-" ? std::nullopt : std::optional<std::uint64_t>(std::stoull(seed)));
    steps_ = 0;
    Answer answer;
    answer.add_all(walker().row());
    return answer;
  }

  Answer step(std::size_t count) {
    const std::size_t size = specification().action_size();
    const std::vector<double> actions = read_numbers(count * size);
    Answer answer;
    for (std::size_t i = 0; i < count; ++i) {
      walker().environment->step(&actions[i * size], size, walker().result);
      ++steps_;
      answer.add_all(walker().row());
      if (walker().has_ended()) break;
    }
    return answer;
  }

  Answer render(std::istream& words) {
    const std::string& id = specification().id;
    const Parameters camera =
        parse_assignments(camera_parameter_descriptions(id), read_rest(words));
    if (!renderer_ || camera != camera_) {
      renderer_ = make_renderer(id, {}, camera);
      camera_ = camera;
    }
    StateCapture captured;
    capture(*walker().environment, steps_, captured);
    Image image;
    renderer_->render(captured, {}, image);
    Answer answer;
    answer.add(std::string(image.rgb.begin(), image.rgb.end()));
    return answer;
  }

  Answer state() {
    Answer answer;
    answer.add(walker().environment->generator_state());
    return answer;
  }

  Answer spaces() {
    const Specification& all = specification();
    Answer answer;
    answer.add(static_cast<double>(all.observation_size()));
    answer.add(static_cast<double>(all.action_size()));
    answer.add_all(all.observation_low);
    answer.add_all(all.observation_high);
    answer.add_all(all.action_low);
    answer.add_all(all.action_high);
    answer.add(all.dt);
    answer.add(all.max_episode_steps);
    answer.add(all.reward_threshold);
    return answer;
  }

  Answer description() {
    Answer answer;
    for (const std::string& name : specification().info_names) answer.add(name + ' ');
    answer.add("\n");
    for (const auto& [name, value] : specification().parameters) {
      answer.add(name + '=' + to_string(value) + '\n');
    }
    return answer;
  }

  static Answer act(std::size_t count) {
    const std::vector<double> observations = read_numbers(count * kObservationSize);
    bipedal_walker::Heuristic heuristic;
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
    answer.add_all(bipedal_walker::terrain_numbers(hardcore, read<std::uint64_t>(words)));
    return answer;
  }

  static Answer random(std::istream& words) {
    Generator generator(read<std::uint64_t>(words));
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

  Stepper& walker() {
    if (!walker_) throw std::logic_error("no environment yet; make one first");
    return *walker_;
  }

  const Specification& specification() { return walker().environment->specification(); }

  std::optional<Stepper> walker_;
  std::uint32_t steps_ = 0;
  std::unique_ptr<Renderer> renderer_;  // of the last picture, made with camera_
  Parameters camera_;
};

}  // namespace
}  // namespace walker

int main() {
  std::ios::sync_with_stdio(false);
  walker::Session session;
  for (std::string line; std::getline(std::cin, line);) {
    try {
      const walker::Answer answer = session.obey(line);
      std::cout << "ok " << answer.bytes().size() << '\n' << answer.bytes() << std::flush;
    } catch (const std::exception& exception) {
      std::cout << "error " << exception.what() << '\n' << std::flush;
    }
  }
  return 0;
}
