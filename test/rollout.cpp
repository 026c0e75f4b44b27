// Steps environments for tests that compare them with Gymnasium without the Python binding. Its
// commands, in the format of pipe.h:
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
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/parameter_text.h"
#include "base/random.h"
#include "pipe.h"
#include "robots/bipedal_walker/bipedal_walker.h"
#include "robots/bipedal_walker/heuristic.h"
#include "robots/bipedal_walker/terrain_numbers.h"
#include "stepper.h"

namespace {

using walker::Answer;
using walker::read;
using walker::read_numbers;
using walker::bipedal_walker::kJointCount;
using walker::bipedal_walker::kObservationSize;

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
    walker_.emplace(id, walker::parse_assignments(walker::parameter_descriptions(id),
                                                  walker::read_rest(words)));
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
    const walker::Parameters camera = walker::parse_assignments(
        walker::camera_parameter_descriptions(id), walker::read_rest(words));
    if (!renderer_ || camera != camera_) {
      renderer_ = walker::make_renderer(id, {}, camera);
      camera_ = camera;
    }
    walker::StateCapture captured;
    walker::capture(*walker().environment, steps_, captured);
    walker::Image image;
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
    const walker::Specification& all = specification();
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
      answer.add(name + '=' + walker::to_string(value) + '\n');
    }
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

  walker::Stepper& walker() {
    if (!walker_) throw std::logic_error("no environment yet; make one first");
    return *walker_;
  }

  const walker::Specification& specification() { return walker().environment->specification(); }

  std::optional<walker::Stepper> walker_;
  std::uint32_t steps_ = 0;
  std::unique_ptr<walker::Renderer> renderer_;  // of the last picture, made with camera_
  walker::Parameters camera_;
};

}  // namespace

int main() {
  Session session;
  walker::serve([&](const std::string& line) { return session.obey(line); });
  return 0;
}
